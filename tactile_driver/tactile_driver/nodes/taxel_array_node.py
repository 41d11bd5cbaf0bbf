# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""taxel_array_node: publishes the images of a taxel array from a serial port, a recording or a simulation; a lifecycle node."""
from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial

from rclpy.lifecycle import LifecycleNode
from sensor_msgs.msg import Image

from ..frame import Frame, MatrixOrder
from ..parameters.drivers import TAXEL_DRIVER_PARAMETERS
from ..sources.registry import TAXEL_SOURCES, make_source
from .driver_node import ACKNOWLEDGE, BaseStream, DriverNode, SeriesPublishers
from .messages.conversions import header_of, image_to_message
from .runtime.host import Host
from .runtime.run import run_node

_DEPTH = 100  # images that wait for a subscriber: a fifth of a second of 500 a second


class TaxelStream(BaseStream):
    """Publishes the frames of source; values: of TAXEL_DRIVER_PARAMETERS."""

    keep = _DEPTH  # slip is estimated from successive frames: none may be lost

    def __init__(self, node: LifecycleNode, publishers: SeriesPublishers, source, values: dict):
        own = values['source'] != 'sim'
        self._order = MatrixOrder(*(own and values[name] for name in ('transposed', 'flip_rows', 'flip_columns')))
        super().__init__(node, publishers, source, values)

    def _publish(self, frame: Frame) -> None:
        header = header_of(frame.stamp_ns, self._values['frame_id'])
        if self._publishers.raw.get_subscription_count():
            frame = replace(frame, image=self._order.ordered(frame.image))
            self._publishers.publish(image_to_message(frame, '', header), self._waited_s)
        self._publish_truth(frame.truth, frame.stamp_ns)
        if self.source.on_demand:
            self._publishers.raw.wait_for_all_acked(ACKNOWLEDGE)


class TaxelArrayNode(DriverNode):
    """One taxel array."""

    def __init__(self, host: Host | None = None):
        super().__init__('taxel_array_node', TAXEL_DRIVER_PARAMETERS, 'taxel array', host)
        self._outputs = SeriesPublishers(self, Image, 'image_raw', _DEPTH)

    def open_stream(self, values: dict) -> TaxelStream:
        """See DriverNode."""
        return TaxelStream(self, self._outputs, self.opened(partial(make_source, TAXEL_SOURCES), values), values)


def main(args: list[str] | None = None) -> None:
    """Entry point of taxel_array_node."""
    sys.exit(run_node(TaxelArrayNode, args))


if __name__ == '__main__':
    main()
