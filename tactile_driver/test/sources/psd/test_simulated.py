# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import time

import numpy as np
import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.serial.psd import PsdSimulatedSource


def test_batches_come_when_they_are_due():
    source = PsdSimulatedSource('demo', 1000.0, 0, 0.02, time.time_ns)
    source.open()
    begin = time.monotonic()
    blocks = [source.read() for _ in range(11)]
    assert time.monotonic() - begin == pytest.approx(0.2, abs=0.1)
    assert {len(b.volts) for b in blocks} == {20} and {b.period_s for b in blocks} == {1e-3}
    steps = np.diff([b.stamp_ns for b in blocks]) / 2e7
    assert np.allclose(steps, np.round(steps), atol=0.02) and (steps > 0.9).all()
    assert source.read(False) is None
    assert source.describe()['rate'] == 1000.0


def test_wrong_settings():
    with pytest.raises(BadArgument, match='real time'):
        PsdSimulatedSource('demo', 0, 0, 0.01, time.time_ns)
    with pytest.raises(BadArgument, match='taps'):
        PsdSimulatedSource('nowhere', -1, 0, 0.01, time.time_ns).open()
