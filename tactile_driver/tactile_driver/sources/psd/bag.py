# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The voltages of a rosbag2 recording, with their recorded stamps."""
from __future__ import annotations

import numpy as np

from ..camera.bag import BagSource
from ...errors import BadFrame
from ...samples import CHANNELS, SampleBlock

_VOLTAGES = 'tactile_msgs/msg/PsdVoltages'


class PsdBagSource(BagSource):
    """A rosbag2 folder or file with tactile_msgs/PsdVoltages. Parameters as of BagSource; rate: messages/s."""

    kinds, content = (_VOLTAGES,), 'voltage'

    def _frame(self, message, stamp: int) -> SampleBlock:
        if len(message.voltages) % CHANNELS or not len(message.voltages):
            raise BadFrame(f'{len(message.voltages)} voltages at {stamp} ns; a sample has four; the message is skipped')
        volts = np.array(message.voltages, np.float32).reshape(-1, CHANNELS)
        return SampleBlock(volts, stamp, float(message.sample_period))
