# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.press.cross_validation import held_out, cross_validation_rmse, score
from tactile_perception.press.presses import Presses
from tactile_perception.press.estimate import TouchEstimate


def presses(places, depths):
    count = len(places)
    position = np.column_stack([places, -np.asarray(depths)])
    unknown = np.full((count, 7), np.nan)
    return Presses((None,) * count, position, np.asarray(depths, float), np.arange(count), unknown[:, :6], unknown[:, 6])


def touch(x, y, depth, sigma=1e-4):
    return TouchEstimate(np.array([x, y, -depth]), depth, sigma**2 * np.eye(3), sigma)


def test_errors_misses_splits_and_false_touches_are_counted():
    known = presses([[0.0, 0.0], [0.01, 0.0], [0.02, 0.0], [np.nan, np.nan]], [1e-3, 2e-3, 3e-3, 0.0])
    found = [[touch(3e-4, 4e-4, 1.2e-3)], [touch(0.01, 0.0, 2e-3), touch(0.02, 0.0, 1e-3)], [], [touch(0.0, 0.0, 1e-3)]]
    got = score(found, known)
    assert got.place_mean == pytest.approx(0.25e-3)
    assert got.place_95 == pytest.approx(0.95 * 0.5e-3)
    assert got.depth_mean == pytest.approx(0.1e-3)
    assert got.squares == pytest.approx((25 + 4) / 3 / 2)
    assert (got.missed, got.split, got.presses, got.false) == (1, 1, 3, 1)


def test_a_few_drags_count_as_much_as_many_presses():
    known = presses([[0.01 * k, 0.0] for k in range(5)], [1e-3] * 5)
    found = [[touch(0.01 * k + off, 0.0, 1e-3)] for k, off in enumerate((2e-4, 1e-4, 3e-4, 4e-3, 6e-3))]
    assert score(found, known).place_median == pytest.approx(3e-4)
    assert score(found, known, np.arange(5) < 3).place_median == pytest.approx((2e-4 + 5e-3) / 2)


def test_where_nothing_is_found_errors_are_not_known():
    got = score([[]], presses([[0.0, 0.0]], [1e-3]))
    assert np.isnan([got.place_mean, got.depth_95, got.squares]).all()
    assert got.missed == 1


class Remembers:
    """Tells the mean of the places that it was fitted to."""

    def __init__(self, mean):
        self.mean = mean

    @classmethod
    def fit(cls, presses, sensor):
        return {'mean': presses.position[presses.touching][:, :2].mean(0).tolist()}

    @classmethod
    def from_fitted(cls, fitted, sensor):
        return cls(fitted['mean'])

    def estimate(self, field):
        return [touch(*self.mean, 1e-3)]


def test_each_place_is_judged_by_a_fit_that_has_not_seen_it():
    known = presses([[0.0, 0.0], [0.0, 0.03], [0.03, 0.0]], [1e-3] * 3)
    got = held_out(Remembers, known, None).score()
    # The mean of the other two places is so far from each.
    expected = [np.hypot(0.015, 0.015), np.hypot(0.015, 0.03), np.hypot(0.015, 0.03)]
    assert got.place_mean == pytest.approx(np.mean(expected))
    assert got.presses == 3


def test_a_method_may_be_fitted_again_more_quickly():
    class Quick(Remembers):
        @classmethod
        def fit_quickly(cls, presses, sensor, fitted):
            return {'mean': [fitted['mean'][0], 0.0]}
    known = presses([[0.0, 0.0], [0.0, 0.03], [0.03, 0.0]], [1e-3] * 3)
    got = held_out(Quick, known, None, {'mean': [0.01, 0.0]}).score()
    assert got.place_mean == pytest.approx(np.mean([0.01, np.hypot(0.01, 0.03), 0.02]))
    assert held_out(Quick, known, None).score().place_mean == held_out(Remembers, known, None).score().place_mean


class Off:
    """Always tells the same place and depth."""

    def estimate(self, field):
        return [TouchEstimate(np.array([1e-3, 0.0, -2e-3]), 2e-3, np.eye(3), 0.0)]


def test_the_spread_is_that_of_the_places_left_out(bell_presses):
    presses = bell_presses([(0, 0), (0, 0.002), (0, -0.002)], depths=(1e-3, 3e-3))
    place, depth = cross_validation_rmse(lambda some: Off(), presses)
    assert depth == pytest.approx(1e-3)
    assert place == pytest.approx(np.sqrt((3 * 1e-6 + 2 * 4e-6) / 6))


def test_one_place_has_no_cross_validation(bell_presses):
    assert np.isnan(cross_validation_rmse(lambda some: Off(), bell_presses([(0, 0)]))).all()
