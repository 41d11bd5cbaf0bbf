# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""psd_node: publishes the voltages of a PSD finger from a serial port, a recording or a simulation; a lifecycle node."""
from __future__ import annotations

from tactile_msgs.msg import PsdVoltages

from ..frame import SampleBlock
from ..parameters.drivers import PSD_DRIVER_PARAMETERS
from ..recordings.truth import RecordedTruth
from ..sources.registry import PSD_SOURCES
from ..sources.source import NS, Source
from .driver_node import DriverNode, Stream
from .health import SampleMeter
from .messages.conversions import header_of, instants, voltages_message
from .runtime.diagnostics import Health
from .runtime.host import Host
from .runtime.run import process_of


class PsdNode(DriverNode):
    """One PSD finger."""

    keep = 100  # no sample may be lost: messages that wait, also for a subscriber, half a second of them
    parameters = PSD_DRIVER_PARAMETERS

    def __init__(self, host: Host | None = None):
        super().__init__('psd_node', self.parameters, 'psd finger', host)
        self.raw = [self.create_lifecycle_publisher(PsdVoltages, 'voltages', self.raw_qos)]

    def open_source(self, values: dict) -> Source:
        """See DriverNode."""
        self._meter = SampleMeter(values['saturation'])
        return self.opened(PSD_SOURCES, values)

    def health(self, stream: Stream) -> Health:
        """See DriverNode."""
        return stream.health(self._meter)

    def publish(self, stream: Stream, block: SampleBlock) -> None:
        """See DriverNode."""
        self._meter.add(block.volts)
        frame_id = stream.values['frame_id']
        if self.raw[0].get_subscription_count():
            self.raw[0].publish(voltages_message(block, frame_id), stream.waited_s)
        if isinstance(block.truth, RecordedTruth):
            self.publish_truth(stream, block.truth, block.stamp_ns)
        elif block.truth is not None and self.truth.wanted:
            for k in instants(block.truth.touching):
                stamp = block.stamp_ns + (round(k * block.period_s * NS) if k else 0)
                self.truth.publish_contacts(block.truth.touches(k), header_of(stamp, frame_id))


main = process_of(PsdNode)
