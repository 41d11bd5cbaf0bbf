# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.markers.regression.green_function import SheetBell
from tactile_perception.markers.regression.matched_filter import BellStart
from tactile_perception.markers.view.marker_field import MarkerField
from tactile_perception.markers.view.sensor import MARKER_SENSORS

GRID = MARKER_SENSORS['areal_single'].grid()


@pytest.fixture(scope='module')
def start():
    bell = SheetBell(np.array([0.060, 0.045]), GRID, np.tile([0.0, 0.0, -0.062], (len(GRID), 1)), 1.2e-3)
    return BellStart(bell, 4e-6, 0.0)


def without(field, gone):
    shift = field.shift.copy()
    shift[gone] = np.nan
    return MarkerField(field.rest, shift, field.growth, field.eye, field.sigma, field.uv, field.duv, field.area)


@pytest.mark.parametrize('place', [(0, 0), (18e-3, 9e-3), (-24e-3, -14e-3)])
@pytest.mark.parametrize('depth', [0.3e-3, 3e-3, 12e-3])
def test_a_press_is_found_roughly(start, bell_field, membrane, place, depth):
    found = start.find(bell_field(place, depth, membrane))
    assert np.hypot(*(found[:2] - place)) < 6e-3 and np.exp(found[2]) == pytest.approx(depth, rel=0.6)


def test_noise_is_no_touch(start, bell_field):
    assert all(start.find(bell_field((0, 0), 0.0, seed=k)) is None for k in range(1000))


def test_missing_markers_do_not_hide_a_press(start, bell_field, membrane):
    field = without(bell_field((9e-3, 0), 3e-3, membrane), slice(0, None, 4))
    assert np.hypot(*(start.find(field)[:2] - [9e-3, 0])) < 6e-3
    assert start.find(without(field, slice(None))) is None


def test_quiet_frames_raise_the_threshold(start, bell_field, membrane):
    faint = bell_field((9e-3, 0), 0.1e-3, membrane)
    louder = BellStart(SheetBell(np.array([0.060, 0.045]), GRID, faint.eye, 1.2e-3), 4e-6, 100.0)
    assert start.find(faint) is not None and louder.find(faint) is None
