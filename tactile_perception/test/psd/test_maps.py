# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception._core import place_values
from tactile_perception.psd.maps import fit_smooth_map, tabulated, trend

PLACE = np.random.default_rng(1).uniform(-1, 1, (500, 2))


def values(place):
    x, y = place.T
    return np.column_stack([np.sin(2 * x) * np.cos(y), 3 * x - y, np.full(len(x), 7.0)])


def test_the_table_between_its_nodes():
    assert place_values(PLACE, tabulated(values)) == pytest.approx(values(PLACE), abs=2e-4)


RNG = np.random.default_rng(4)


def truth(place):
    x, y = place.T
    return np.stack([1.6 * x + 0.3 * x * (x * x + y * y) + 0.02 * np.sin(5 * y), 1.6 * y + 0.02 * np.cos(4 * x)], axis=1)


def scattered(count, reach=0.7):
    place = RNG.uniform(-reach, reach, (4 * count, 2))
    return place[np.linalg.norm(place, axis=1) < reach][:count]


@pytest.mark.parametrize(('count', 'largest'), [(30, 0.02), (100, 0.008)])
def test_more_contacts_make_less_error(count, largest):
    place, noise = scattered(count), np.full(count, 0.002)
    smooth, left_out = fit_smooth_map(place, truth(place) + RNG.normal(0, 0.002, (count, 2)), noise)
    inside = scattered(500, 0.6)
    error = np.linalg.norm(smooth.values(inside) - truth(inside), axis=1)
    assert np.sqrt(np.mean(error**2)) < largest
    assert 0.3 < np.sqrt(np.mean(error**2)) / np.sqrt(2 * np.mean(smooth.deviation(inside)**2)) < 1.3
    assert np.sqrt(np.mean(left_out**2)) < 2 * largest


def test_leave_one_out_residuals_equal_those_of_a_fit_without_the_contact():
    place, noise = scattered(20), np.full(20, 0.004)
    values = truth(place) + RNG.normal(0, 0.004, (20, 2))
    smooth, left_out = fit_smooth_map(place, values, noise)
    from tactile_perception.psd.maps import SmoothMap, _solved
    hyper = smooth.length, smooth.amplitude, smooth.extra
    _, slopes, weights, *_ = _solved(place[1:], values[1:], noise[1:], 5, hyper)
    without = SmoothMap(place[1:], slopes, weights, *hyper, noise[1:], np.ones(19))
    assert values[0] - without.values(place[:1])[0] == pytest.approx(left_out[0], rel=1e-6)


def test_no_oscillation_between_and_beyond_contacts():
    place = scattered(40, 0.4)
    smooth, _ = fit_smooth_map(place, truth(place) + RNG.normal(0, 0.003, (40, 2)), np.full(40, 0.003), 3)
    line = np.stack([np.linspace(-1, 1, 400), np.zeros(400)], axis=1)
    assert (np.diff(smooth.values(line)[:, 0]) > 0).all()
    assert np.abs(smooth.values(line) - trend(line, 3) @ smooth.slopes).max() < 0.15
    assert smooth.deviation(np.array([[0.95, 0.0]]))[0] > 2 * smooth.deviation(np.array([[0.0, 0.0]]))[0]
