# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels steady_motion and noise_of_places (src/common/steady_motion.cpp) against lines by least squares and NumPy."""
import numpy as np
import pytest
from tactile_perception._core import noise_of_places, steady_motion

RATE, SIGMA = 100.0, 1e-3


def lines(times, places):
    """Place, velocity and its error over the last n places, for each n from 2 on."""
    for n in range(2, len(times) + 1):
        t = times[-n:] - times[-1]
        design = np.stack([np.ones(n), t], axis=1)
        place, velocity = np.linalg.lstsq(design, places[-n:], rcond=None)[0]
        yield place, velocity, SIGMA / np.sqrt(((t - t.mean())**2).sum()), n


def longest(times, places, bound):
    """The longest line whose velocity lies within the bounds of all shorter ones."""
    found, low, high = (places[-1], np.zeros(3), np.inf, 1), np.full(3, -np.inf), np.full(3, np.inf)
    for line in lines(times, places):
        low, high = np.maximum(low, line[1] - bound * line[2]), np.minimum(high, line[1] + bound * line[2])
        if (low > high).any():
            break
        found = line
    return found


@pytest.mark.parametrize('seed', range(20))
def test_the_line_is_that_of_least_squares(seed):
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.5, 1.5, rng.integers(2, 30))) / RATE
    places = np.cumsum(rng.normal(0, 1, 3) * (times[:, None] > times.mean()) / RATE, axis=0) + rng.normal(0, SIGMA, (len(times), 3))
    found, expected = steady_motion(times, places, sigma=SIGMA, bound=2.5), longest(times, places, 2.5)
    for one, other in zip(found, expected):
        assert one == pytest.approx(other, rel=1e-6, abs=1e-9)


def test_a_stop_is_seen_within_two_frames_and_a_slow_motion_averaged_over_all():
    times = np.arange(20) / RATE
    stopped = np.minimum(np.arange(20), 17)[:, None] * np.array([0.02, 0.0, 0.0])
    assert steady_motion(times, stopped, sigma=SIGMA, bound=2.5)[1][0] == pytest.approx(0, abs=0.3)
    slow = np.arange(20)[:, None] * np.array([1e-4, 0, 0]) + np.random.default_rng(0).normal(0, SIGMA, (20, 3))
    assert steady_motion(times, slow, sigma=SIGMA, bound=2.5)[3] == 20


def test_one_place_has_no_velocity_and_none_nothing():
    place, velocity, sigma, used = steady_motion(np.ones(1), np.ones((1, 3)), sigma=SIGMA, bound=2.5)
    assert used == 1 and (place == 1).all() and not velocity.any() and sigma > 1e300
    assert steady_motion(np.zeros(0), np.zeros((0, 3)), sigma=SIGMA, bound=2.5)[3] == 0


@pytest.mark.parametrize('count', [4, 5, 9, 30])
def test_noise_is_that_of_second_differences_without_the_last(count):
    rng = np.random.default_rng(count)
    places = 0.1 * np.arange(count)[:, None] + rng.normal(0, SIGMA, (count, 3))
    bend = np.diff(places, 2, axis=0)[:-1]
    assert noise_of_places(places) == pytest.approx(np.median(np.hypot(bend[:, 0], bend[:, 1])) / np.sqrt(12 * np.log(2)), rel=1e-9)
    assert noise_of_places(places[:3]) == 0


def test_noise_is_a_standard_deviation():
    assert noise_of_places(np.random.default_rng(0).normal(0, SIGMA, (10_000, 3))) == pytest.approx(SIGMA, rel=0.03)
