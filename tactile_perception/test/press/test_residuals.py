# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Presses that cannot determine a sheet's touches are refused with what to add; errors of those held out have their place and time."""
import numpy as np
import pytest
from tactile_perception.errors import BadCalibration
from tactile_perception.press.cross_validation import HeldOut
from tactile_perception.press.presses import Presses
from tactile_perception.press.estimate import TouchEstimate
from tactile_perception.press.residuals import marker_residuals, require_coverage


def presses(places):
    """At (x, y, depth), m; a depth of 0 is untouched."""
    places = np.array(places, float)
    position = np.where(places[:, 2:] > 0, places * [1, 1, -1], np.nan)
    count = len(places)
    return Presses(tuple(object() for _ in places), position, places[:, 2], np.arange(count), np.full((count, 6), np.nan),
                   np.full(count, np.nan))


GRID = [(x, 0.0, depth) for x in (0.0, 0.01, 0.02) for depth in (0.002, 0.004)]


def test_enough_is_enough():
    require_coverage(presses([*GRID, (0, 0, 0)]))


@pytest.mark.parametrize('places, reason', [
    ([(0, 0, 0), *GRID[:4]], '4 presses at 2 positions; at least 3'),
    ([(0, 0, 0), *[(x, y, 0.003) for x, y, _ in GRID]], 'all presses are 3.00 to 3.00 mm deep: one depth'),
    (GRID, 'no untouched frame')])
def test_too_little_is_refused_with_what_to_add(places, reason):
    with pytest.raises(BadCalibration, match=reason):
        require_coverage(presses(places))


def test_errors_are_over_the_surface_in_mm_and_have_their_time():
    known = presses([(0.01, 0.0, 0.002), (0.0, 0.005, 0.004), (0, 0, 0)])
    number = np.array([2, 0, 1])

    def touch(x, y, depth):
        return TouchEstimate(np.array([x, y, -depth]), depth, 1e-8 * np.eye(3), 1e-4)
    held = HeldOut([[touch(0.02, 0.02, 0.009), touch(0.0103, 0.0004, 0.0019)], [], []], known, np.ones(3, bool), number)
    place, depth = marker_residuals(held, ['bag at 2.0 s', 'bag at 3.0 s', 'bag at 1.0 s'])
    assert place.value == pytest.approx([0.5, np.nan], nan_ok=True) and depth.value == pytest.approx([-0.1, np.nan], nan_ok=True)
    assert place.place == pytest.approx(np.array([[10, 0], [0, 5]])) and place.when == ['bag at 1.0 s', 'bag at 2.0 s']
