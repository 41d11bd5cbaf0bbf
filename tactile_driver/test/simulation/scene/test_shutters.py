# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Two shutters: offset, drift and jitter as asked, and always nearest to the exposure of the same number."""
import numpy as np
import pytest

from tactile_driver.simulation.scene.shutters import Shutters


def test_offset_drift_and_jitter():
    assert (Shutters(0.004).delays(100, 30.0) == 0.004).all()
    swung = Shutters(0.002, 0.006).delays(600, 30.0)
    assert swung.mean() == pytest.approx(0.002, abs=1e-9) and np.ptp(swung) == pytest.approx(0.012, rel=1e-3)
    assert np.abs(np.diff(np.r_[swung, swung[0]])).max() < 1e-4, 'a scene that repeats goes on without a leap'
    shaky = Shutters(jitter=5e-4).delays(600, 30.0)
    assert shaky.std() == pytest.approx(5e-4, rel=0.1) and (shaky == Shutters(jitter=5e-4).delays(600, 30.0)).all()
    assert (shaky != Shutters(jitter=5e-4, seed=1).delays(600, 30.0)).any()


@pytest.mark.parametrize('offset', [0.1, -0.1])
def test_the_exposure_of_the_same_number_is_the_nearest(offset):
    delays = Shutters(offset, 0.01, 0.002).delays(200, 30.0)
    assert np.abs(delays).max() < 0.5 / 30 and (np.sign(delays) == np.sign(offset)).all()
