# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import dataclasses

import numpy as np
import pytest
from dome_scenes import DOME, calibration, dome_field, dome_presses
from tactile_perception.errors import BadArgument, BadCalibration
from tactile_perception.markers.regression.dome import DomeRegression
from tactile_perception.markers.touches.cross_validation import judge
from tactile_perception.markers.touches.touch import AT_EDGE, OUT_OF_RANGE

PLACES = np.random.default_rng(3).uniform(-0.038, 0.038, (8, 2))

pytestmark = pytest.mark.full  # its calibration takes eight seconds


@pytest.fixture(scope='module')
def fitted():
    return DomeRegression.fit(calibration(), DOME)


@pytest.fixture(scope='module')
def method(fitted):
    return DomeRegression.from_fitted(fitted, DOME)


def test_the_calibrated_tip_is_told_elsewhere_and_at_other_depths(method):
    score = judge(method, dome_presses(PLACES, (0.009, 0.018, 0.033), seed=7))
    assert score.place_mean < 0.6e-3 and score.place_95 < 1.5e-3 and score.depth_mean < 0.1e-3 and score.depth_95 < 0.3e-3
    assert score.missed == score.split == 0 and score.squares < 1.5


def test_smaller_and_larger_balls_are_told_with_honest_covariance(method):
    scores = [judge(method, dome_presses(PLACES, (0.009, 0.018, 0.033), ball=ball, seed=9)) for ball in (0.0175, 0.025, 0.035)]
    assert max(score.place_mean for score in scores) < 1.5e-3 and max(score.depth_mean for score in scores) < 1.2e-3
    assert 0.3 < np.mean([score.squares for score in scores]) < 1.5 and not any(score.split for score in scores)


def test_two_touches_three_pitches_apart_are_both_told(method):
    rng, found = np.random.default_rng(12), []
    for angle in rng.uniform(0, 2 * np.pi, 30):
        half = rng.uniform(0.021, 0.03) * np.array([np.cos(angle), np.sin(angle)])
        middle, depths = rng.uniform(-0.015, 0.015, 2), rng.uniform(0.008, 0.025, 2)
        told = method.estimate(dome_field([(middle + half, depths[0]), (middle - half, depths[1])]))
        off = [min(np.hypot(*(touch.position[:2] - place)) for touch in told) for place in (middle + half, middle - half)]
        found.append(len(told) == 2 and max(off) < 3e-3)
    assert np.mean(found) > 0.95


def test_untouched_frames_are_told_as_such(method):
    assert not any(method.estimate(dome_field(seed=k)) for k in range(300))


def test_deeper_and_further_out_than_calibrated_is_flagged(method):
    flags = [method.estimate(dome_field([(place, depth)]))[0].flags for place, depth in (((0.02, 0.01), 0.02), ((0.0, 0.0), 0.05),
                                                                                        ((0.09, 0.0), 0.02))]
    assert flags[0] == 0 and flags[1] == OUT_OF_RANGE and flags[2] & AT_EDGE


def test_what_a_dent_does_not_explain_widens_the_covariance(method):
    field = dome_field([((0.02, 0.01), 0.02)])
    plain, = method.estimate(field)
    field.shift[:] += np.random.default_rng(5).normal(0, 1e-3, field.shift.shape)
    spoilt = method.estimate(field)[0]
    assert spoilt.covariance[0, 0] > 4 * plain.covariance[0, 0] and np.hypot(*(spoilt.position[:2] - [0.02, 0.01])) < 5e-3


def test_lost_markers_widen_the_covariance(method):
    field = dome_field([((0.02, 0.01), 0.02)])
    whole, = method.estimate(field)
    field.shift[np.hypot(*(field.rest - [0.02, 0.01]).T) < 0.03] = np.nan
    part, = method.estimate(field)
    assert np.hypot(*(part.position[:2] - [0.02, 0.01])) < 3e-3 and part.covariance[0, 0] > whole.covariance[0, 0]
    field.shift[12:] = np.nan
    assert method.estimate(field) == []


def test_what_does_not_fit_is_refused(fitted, method):
    with pytest.raises(BadCalibration, match='too few'):
        DomeRegression.fit(dome_presses([(0, 0)], (0.01, 0.02)), DOME)
    with pytest.raises(BadCalibration, match='calibrate anew'):
        DomeRegression.from_fitted({key: value for key, value in fitted.items() if key != 'coefficients'}, DOME)
    with pytest.raises(BadArgument, match='289 markers'):
        field = dome_field()
        method.estimate(type(field)(*(getattr(field, part.name)[:50] for part in dataclasses.fields(field))))
