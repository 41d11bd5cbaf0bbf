# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The taxel images of a rosbag2 recording, mono8 or mono16."""
from __future__ import annotations

from ..camera.bag import BagSource
from ...frame import Frame
from ...matrix import matrix_frame
from ...pixels import GREY, pixels_of


class TaxelBagSource(BagSource):
    """A rosbag2 folder or file with sensor_msgs/Image in mono8 or mono16. Parameters as of BagSource; shape: (rows, columns)."""

    kinds, content = ('sensor_msgs/msg/Image',), 'image'

    def __init__(self, path: str, topic: str, rate: float, loop: bool, shape: tuple[int, int]):
        super().__init__(path, topic, rate, loop)
        self._shape = shape

    def _frame(self, message, name: str, stamp: int) -> Frame:
        place = f'the image of {self._topic} at {stamp} ns'
        size = message.height, message.width, message.step
        values = pixels_of(message.data, size, message.encoding, bool(message.is_bigendian), place, GREY)
        return matrix_frame(values, self._shape, stamp, place)
