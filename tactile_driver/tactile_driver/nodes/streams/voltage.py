# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stream of a PSD finger's samples."""
from __future__ import annotations

from rclpy.lifecycle import LifecycleNode
from tactile_msgs.msg import PsdVoltages

from .base import ACKNOWLEDGE, BaseStream, SeriesPublishers
from ..messages.conversions import header_of, instants, voltages_message
from ..health import SampleMeter, capture_health
from ..runtime.diagnostics import Health
from ...recordings.truth import RecordedTruth
from ...samples import SampleBlock
from ...sources.base.pacing import NS

_DEPTH = 100  # messages that wait for a subscriber: half a second of them


def voltage_publishers(node: LifecycleNode) -> SeriesPublishers:
    """voltages, and the topics of all drivers."""
    return SeriesPublishers(node, PsdVoltages, 'voltages', _DEPTH)


class VoltageStream(BaseStream):
    """Publishes the blocks of source; values: of PSD_DRIVER_PARAMETERS."""

    keep = _DEPTH  # no sample may be lost

    def __init__(self, node: LifecycleNode, publishers: SeriesPublishers, source, values: dict):
        self.meter = SampleMeter(values['saturation'])
        super().__init__(node, publishers, source, values)

    def health(self) -> Health:
        """For /diagnostics."""
        return capture_health(self.status, self.source.describe(), self.source.live, self.remark, meter=self.meter)

    def _publish(self, block: SampleBlock) -> None:
        self.meter.add(block.volts)
        if self._publishers.raw.get_subscription_count():
            self._publishers.publish(voltages_message(block, self._values['frame_id']), self._waited_s)
            if self.source.on_demand:
                self._publishers.raw.wait_for_all_acked(ACKNOWLEDGE)
        if isinstance(block.truth, RecordedTruth):
            self._publish_truth(block.truth, block.stamp_ns)
        elif block.truth is not None and self._publishers.truth.wanted:
            for k in instants(block.truth.touching):
                stamp = block.stamp_ns + (round(k * block.period_s * NS) if k else 0)
                self._publishers.truth.publish_contacts(block.truth.touches(k), header_of(stamp, self._values['frame_id']))
