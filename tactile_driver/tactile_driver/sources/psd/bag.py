# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The voltages of a rosbag2 recording, with their recorded stamps."""
from __future__ import annotations

import numpy as np
from rosbags.typesys import get_types_from_msg

from ..camera.bag import BagSource
from ...errors import BadFrame
from ...samples import CHANNELS, SampleBlock

_VOLTAGES = 'tactile_msgs/msg/PsdVoltages'
_DEFINITION = 'std_msgs/Header header\nfloat64 sample_period\nfloat32[] voltages\n'


class PsdBagSource(BagSource):
    """A rosbag2 folder or file with tactile_msgs/PsdVoltages. Parameters as of BagSource; rate: messages/s."""

    kinds, content = (_VOLTAGES,), 'voltage'

    def __init__(self, path: str, topic: str, rate: float, loop: bool):
        super().__init__(path, topic, rate, loop)
        self._types.register(get_types_from_msg(_DEFINITION, _VOLTAGES))

    def _frame(self, message, name: str, stamp: int) -> SampleBlock:
        if len(message.voltages) % CHANNELS or not len(message.voltages):
            raise BadFrame(f'{len(message.voltages)} voltages at {stamp} ns; a sample has four; the message is skipped')
        volts = np.array(message.voltages, np.float32).reshape(-1, CHANNELS)
        return SampleBlock(volts, stamp, float(message.sample_period))
