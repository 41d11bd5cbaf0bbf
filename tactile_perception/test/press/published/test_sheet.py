# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument, BadCalibration
from tactile_perception.press.published.sheet import PaperTouch
from tactile_perception.press.estimate import AT_EDGE, OUT_OF_RANGE
from tactile_perception.press.sensor import MARKER_SENSORS

SHEET = MARKER_SENSORS['areal_single']


@pytest.fixture(scope='module')
def fitted(bell_presses):
    return PaperTouch.fit(bell_presses(), SHEET)


def test_a_gaussian_bell_is_told_to_half_a_pitch(fitted, bell_field):
    method = PaperTouch.from_fitted(fitted, SHEET)
    touch, = method.estimate(bell_field((9e-3, -4.5e-3), 4e-3))
    assert np.hypot(*(touch.position[:2] - [9e-3, -4.5e-3])) < 2e-3 and touch.depth == pytest.approx(4e-3, abs=3e-4)
    assert touch.position[2] == -touch.depth and np.isfinite(touch.covariance).all()


def test_nothing_is_told_at_rest(fitted, bell_field):
    method = PaperTouch.from_fitted(fitted, SHEET)
    assert method.estimate(bell_field((0, 0), 0.0, seed=77)) == []


def test_beyond_the_calibrated_range_and_at_the_edge_it_is_flagged(fitted, bell_field):
    method = PaperTouch.from_fitted(fitted, SHEET)
    assert method.estimate(bell_field((9e-3, -9e-3), 9e-3))[0].flags & OUT_OF_RANGE
    touch, = method.estimate(bell_field((28e-3, 0), 4e-3))
    assert touch.flags & AT_EDGE and abs(touch.position[0]) <= 30e-3


def test_bad_numbers_are_refused(fitted):
    with pytest.raises(BadCalibration, match='calibrate anew'):
        PaperTouch.from_fitted({'quiet': 1}, SHEET)
    with pytest.raises(BadArgument, match='grid'):
        PaperTouch.from_fitted(fitted, MARKER_SENSORS['air_cushion'])
