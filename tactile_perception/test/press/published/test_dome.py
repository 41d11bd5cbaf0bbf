# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument, BadCalibration
from tactile_perception.press.published.dome import PaperCushion, distance_changes, four_largest, neighbours
from tactile_perception.press.field import MarkerField
from tactile_perception.press.sensor import MARKER_SENSORS

SHEET = MARKER_SENSORS['areal_single']
RING = np.array([[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1], [2, 2.0]])


def field(places):
    plain = np.full(len(RING), 1e-6)
    return MarkerField(RING, places - RING, plain, np.tile([0, 0, -1.0], (6, 1)), plain, RING, places - RING, plain)


def test_the_change_of_the_mean_distance_to_five(ring=RING):
    near = neighbours(RING)
    assert sorted(near[0]) == [1, 2, 3, 4, 5]
    changes = distance_changes(field(RING * 1.1), near)
    assert changes[0] == pytest.approx(0.1 * (4 + np.sqrt(8)) / 5)
    moved = RING.copy()
    moved[5] = np.nan
    assert np.isnan(distance_changes(field(moved), near)[5]) and distance_changes(field(moved), near)[0] == pytest.approx(0, abs=1e-12)


def test_four_largest_are_weighted_by_their_changes():
    changes = np.array([4.0, 3.0, 2.0, 1.0, 0.5, np.nan])
    place, mean = four_largest(changes, RING, 10.0)
    assert place == pytest.approx(np.array([4, 3, 2, 1]) @ RING[:4] / 10) and mean == 2.5
    place, mean = four_largest(np.array([4.0, 0, 0, 0, 0, 3.0]), RING, 0.5)
    assert place == pytest.approx(RING[0]) and mean == 4.0
    assert four_largest(np.zeros(6), RING, 1.0) is None


def test_a_press_is_told_to_a_pitch_and_nothing_at_rest(bell_field, bell_presses):
    method = PaperCushion.from_fitted(PaperCushion.fit(bell_presses(), SHEET), SHEET)
    touch, = method.estimate(bell_field((9e-3, 9e-3), 5e-3))
    assert np.hypot(*(touch.position[:2] - 9e-3)) < 9e-3 and touch.depth == pytest.approx(5e-3, abs=2.5e-3)
    assert method.estimate(bell_field((0, 0), 0.0, seed=55)) == []


def test_what_does_not_fit_is_refused(bell_presses):
    fitted = PaperCushion.fit(bell_presses(), SHEET)
    with pytest.raises(BadArgument, match='117 markers'):
        PaperCushion.from_fitted(fitted, SHEET).estimate(field(RING))
    with pytest.raises(BadCalibration, match='calibrate anew'):
        PaperCushion.from_fitted({}, SHEET)
    with pytest.raises(BadCalibration, match='6 markers'):
        neighbours(RING[:5])
