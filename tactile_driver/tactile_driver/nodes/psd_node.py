# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""psd_node: publishes the voltages of a PSD finger from a serial port, a recording or a simulation; a lifecycle node."""
from __future__ import annotations

import sys
from functools import partial

from rclpy.lifecycle import LifecycleNode
from tactile_msgs.msg import PsdVoltages

from ..parameters.drivers import PSD_DRIVER_PARAMETERS
from ..recordings.reader import RecordedTruth
from ..samples import SampleBlock
from ..sources.registry import PSD_SOURCES, make_source
from ..sources.source import NS
from .driver_node import ACKNOWLEDGE, BaseStream, DriverNode, SeriesPublishers
from .health import SampleMeter, capture_health
from .messages.conversions import header_of, instants, voltages_message
from .runtime.diagnostics import Health
from .runtime.host import Host
from .runtime.run import run_node

_DEPTH = 100  # messages that wait for a subscriber: half a second of them


class VoltageStream(BaseStream):
    """Publishes the blocks of source; values: of PSD_DRIVER_PARAMETERS."""

    keep = _DEPTH  # no sample may be lost

    def __init__(self, node: LifecycleNode, publishers: SeriesPublishers, source, values: dict):
        self.meter = SampleMeter(values['saturation'])
        super().__init__(node, publishers, source, values)

    def health(self) -> Health:
        """For /diagnostics."""
        return capture_health(self.status, self.source.describe(), self.source.live, self.warning, meter=self.meter)

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


class PsdNode(DriverNode):
    """One PSD finger."""

    def __init__(self, host: Host | None = None):
        super().__init__('psd_node', PSD_DRIVER_PARAMETERS, 'psd finger', host)
        self._outputs = SeriesPublishers(self, PsdVoltages, 'voltages', _DEPTH)

    def open_stream(self, values: dict) -> VoltageStream:
        """See DriverNode."""
        return VoltageStream(self, self._outputs, self.opened(partial(make_source, PSD_SOURCES), values), values)


def main(args: list[str] | None = None) -> None:
    """Entry point of psd_node."""
    sys.exit(run_node(PsdNode, args))


if __name__ == '__main__':
    main()
