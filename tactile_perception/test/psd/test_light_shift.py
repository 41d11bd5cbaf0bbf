# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
from tactile_perception.psd.light_shift import LightShift, fit_light_shift
from tactile_perception.psd.maps import fit_smooth_map

RNG = np.random.default_rng(3)


def presses(count=100, pull=0.1):
    """Places, tangent vectors and light of presses whose light pulls them to the pole by a part."""
    place = RNG.uniform(-0.6, 0.6, (count, 2))
    strength = RNG.uniform(0.6, 1.4, count)
    light = 3 * strength * np.exp(-2 * (place**2).sum(1))
    values = 1.6 * place * (1 - pull * (strength - 1))[:, None] + RNG.normal(0, 0.002, (count, 2))
    return place, values, light, strength


def test_the_pull_of_the_light_is_found():
    place, values, light, strength = presses()
    smooth, _ = fit_smooth_map(place, values, np.full(100, 0.002))
    found = fit_light_shift(place, values, light, smooth)
    true = -1.6 * 0.1 * place
    assert np.std(found.bend(place) - true) < 0.15 * np.std(true)
    assert np.std(np.log(found.light(place) * strength / light)) < 0.1


def test_light_that_pulls_nothing_moves_nothing():
    place, values, light, _ = presses(pull=0.0)
    smooth, _ = fit_smooth_map(place, values, np.full(100, 0.002))
    assert np.std(fit_light_shift(place, values, light, smooth).bend(place)) < 5e-3


def test_far_from_calibrated_light_it_is_bounded():
    shift = LightShift(np.array([1.0, 50, 0, 0, 0]), np.ones((4, 2)))
    corner = np.array([[1.0, 1.0], [0, 0]])
    assert np.isfinite(shift.light(corner)).all()
    assert shift.relative(corner, np.array([0.0, 1e9])).tolist() == [-1, 1]
