# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The taxel images of a rosbag2 recording, of 8 or 16 bits."""
from __future__ import annotations

from ..camera.bag import BagSource
from ...frame import Frame
from ...matrix import matrix_frame
from ...nodes.messages.images import grey_to_array


class TaxelBagSource(BagSource):
    """A rosbag2 folder or file with sensor_msgs/Image or CompressedImage in grey. Parameters as of BagSource; shape: (rows, columns)."""

    def __init__(self, path: str, topic: str, rate: float, loop: bool, shape: tuple[int, int]):
        super().__init__(path, topic, rate, loop)
        self._shape = shape

    def _frame(self, message, stamp: int) -> Frame:
        place = f'the image of {self._topic} at {stamp} ns'
        return matrix_frame(grey_to_array(message, place), self._shape, stamp, place)
