# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.dots.reference.calibrated_rest import CalibratedRest

ROW, COLUMN = np.divmod(np.arange(117), 13)
ID, UV = np.arange(117), np.stack([COLUMN, ROW], axis=1) * 40.0 + 80
MIDDLE = UV.mean(axis=0)
KNOWN = CalibratedRest(UV)


def press(place, size, width=100.0):
    """A press's displacements, px: outwards from the image's middle, most beside the place pressed."""
    bell = np.exp(-((UV - place)**2).sum(axis=1) / (2 * width**2))
    return size * bell[:, None] * (UV - MIDDLE) / 150 + 0.2 * size * bell[:, None] * (UV - place) / width


def noise(size, seed=0):
    return np.random.default_rng(seed).normal(0, size, UV.shape)


@pytest.mark.parametrize('moved', [0.0, [3.0, -2.0], (UV - MIDDLE) * 0.02, (UV - MIDDLE)[:, ::-1] * [0.03, -0.03], noise(0.5, 1)],
                         ids=['still', 'shifted', 'swollen', 'turned', 'another print'])
def test_what_is_no_press_is_none(moved):
    for seed in range(20):
        judged = KNOWN.judge(ID, UV + moved + noise(0.05, seed))
        assert not judged.pressed and judged.reason == ''


@pytest.mark.parametrize('place', [(140.0, 120.0), (330.0, 250.0), (520.0, 200.0)])
@pytest.mark.parametrize('size', [1.0, 5.0, 15.0])
def test_a_press_is_one_and_the_calibrated_places_hold(place, size):
    judged = KNOWN.judge(ID, UV + press(place, size) + noise(0.05))
    assert judged.pressed and judged.known and 'was touched' in judged.reason


def test_a_press_where_the_camera_has_moved_too_leaves_no_place_known():
    judged = KNOWN.judge(ID, UV + press((250.0, 150.0), 10.0) + [20.0, 0.0])
    assert judged.pressed and not judged.known and 'calibrate again' in judged.reason


def test_dots_that_are_missing_or_unknown_are_left_out():
    rest = UV.copy()
    rest[:40] = np.nan
    seen = np.r_[20:110]
    now = UV + press((330.0, 250.0), 5.0)
    now[100] = np.nan
    assert CalibratedRest(rest).judge(ID[seen], now[seen]).pressed
    assert not CalibratedRest(rest).judge(np.r_[ID[:60], 300], np.vstack([now[:60], [[0, 0]]])).pressed, 'of twenty nothing is said'


def test_a_camera_has_stayed_where_the_dots_are_at_their_calibrated_places():
    assert KNOWN.judge(ID, UV + noise(0.02)).stayed
    assert not KNOWN.judge(ID, UV + [0.1, 0.0] + noise(0.02)).stayed, 'the camera has moved'
    assert not KNOWN.judge(ID, UV + press((330.0, 250.0), 5.0)).stayed, 'something presses'


def test_places_are_the_calibrated_ones_and_nan_where_there_are_none():
    found = KNOWN.places(np.array([3, 300, 116]))
    assert (found[[0, 2]] == UV[[3, 116]]).all() and np.isnan(found[1]).all()
