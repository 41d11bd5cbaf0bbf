# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""taxel_array_node: publishes the images of a taxel array from a serial port, a recording or a simulation; a lifecycle node."""
from __future__ import annotations

from dataclasses import replace

from sensor_msgs.msg import Image

from ..frame import Frame, in_sensor_order
from ..parameters.drivers import TAXEL_DRIVER_PARAMETERS
from ..sources.registry import TAXEL_SOURCES
from ..sources.source import Source
from .driver_node import DriverNode, Stream
from .messages.conversions import header_of, image_to_message
from .runtime.host import Host
from .runtime.run import process_of


class TaxelArrayNode(DriverNode):
    """One taxel array."""

    keep = 100  # slip is estimated from successive frames, none may be lost: images that wait, also for a subscriber, 0.2 s of 500 a second
    parameters = TAXEL_DRIVER_PARAMETERS

    def __init__(self, host: Host | None = None):
        super().__init__('taxel_array_node', self.parameters, 'taxel array', host)
        self.raw = [self.create_lifecycle_publisher(Image, 'image_raw', self.raw_qos)]

    def open_source(self, values: dict) -> Source:
        """See DriverNode."""
        return self.opened(TAXEL_SOURCES, values)

    def publish(self, stream: Stream, frame: Frame) -> None:
        """See DriverNode."""
        if self.raw[0].get_subscription_count():
            if stream.values['source'] != 'sim':
                frame = replace(frame, image=in_sensor_order(frame.image, stream.values))
            self.raw[0].publish(image_to_message(frame, '', header_of(frame.stamp_ns, stream.values['frame_id'])), stream.waited_s)
        self.publish_truth(stream, frame.truth, frame.stamp_ns)


main = process_of(TaxelArrayNode)
