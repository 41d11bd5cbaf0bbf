# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import time

import numpy as np
import pytest
from tactile_driver.errors import BadArgument
from tactile_driver.serial.taxel import TaxelSimulatedSource


def test_frames_come_at_their_pace_with_truth():
    source = TaxelSimulatedSource('disc', 50.0, 0, time.time_ns)
    source.open()
    frames = [source.read() for _ in range(4)]
    assert np.diff([frame.stamp_ns for frame in frames]) == pytest.approx([20e6] * 3, abs=1e6)
    assert frames[0].image.shape == (44, 44) and frames[0].truth.area == 0 and frames[0].encoding == 'mono8'
    assert source.read(wanted=False) is None


def test_wrong_words():
    with pytest.raises(BadArgument, match='real time'):
        TaxelSimulatedSource('disc', 0, 0, time.time_ns)
    with pytest.raises(BadArgument, match='two_fingers'):
        TaxelSimulatedSource('nowhere', 50.0, 0, time.time_ns).open()
