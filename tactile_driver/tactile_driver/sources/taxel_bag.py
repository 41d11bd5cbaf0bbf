# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The taxel images of a rosbag2 recording, with all their bits."""
from __future__ import annotations

import numpy as np

from ..errors import BadFrame
from ..frame import Frame
from ..matrix import matrix_frame
from .bag import BagSource

_KINDS = {'mono8': np.uint8, 'mono16': np.uint16}


class TaxelBagSource(BagSource):
    """A rosbag2 folder or file with sensor_msgs/Image in mono8 or mono16. Parameters as of BagSource; shape: (rows, columns)."""

    kinds, content = ('sensor_msgs/msg/Image',), 'image'
    remark = ''

    def __init__(self, path: str, topic: str, rate: float, loop: bool, shape: tuple[int, int]):
        super().__init__(path, topic, rate, loop)
        self._shape = shape

    def _frame(self, message, name: str, stamp: int) -> Frame:
        place = f'the image of {self._topic} at {stamp} ns'
        if message.encoding not in _KINDS:
            raise BadFrame(f'{place} has encoding {message.encoding!r}; usable are {", ".join(_KINDS)}; it is skipped')
        kind = np.dtype(_KINDS[message.encoding]).newbyteorder('>' if message.is_bigendian else '<')
        data, width = np.asarray(message.data, np.uint8), message.width * kind.itemsize
        if message.step < width or len(data) != message.height * message.step or not width:
            raise BadFrame(f'{place}: {len(data)} bytes do not make {message.width} x {message.height} {message.encoding}; it is skipped')
        values = np.ascontiguousarray(data.reshape(message.height, message.step)[:, :width]).view(kind)
        return matrix_frame(values.astype(_KINDS[message.encoding]), self._shape, stamp, place)
