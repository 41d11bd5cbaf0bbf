# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.markers.wrench.varying_coefficients import VaryingFactors


def made(count, seed=0, noise=0.0):
    """Two factors that vary with one of two states, times two features."""
    rng = np.random.default_rng(seed)
    states, features = rng.uniform(-1, 1, (count, 2)), rng.normal(0, 1, (count, 2))
    values = features[:, 0] * (2 + np.sin(2 * states[:, 0])) - 0.5 * features[:, 1] * states[:, 0]
    return states, features, values + rng.normal(0, noise, count), np.ones(count)


def told(factors, states, at, features):
    near = np.exp(-0.5 * np.sum(((states - at) / factors.lengths)**2, axis=1))
    return float(near @ factors.dual @ features)


def test_values_elsewhere_are_told():
    data = made(80)
    factors, (states, features, values, _) = VaryingFactors(*data), made(30, seed=1)
    assert max(abs(told(factors, data[0], *row[:2]) - row[2]) for row in zip(states, features, values)) < 0.05


def test_values_left_out_are_told_as_if_the_others_were_all():
    states, features, values, unsure = made(40, noise=0.05)
    groups, whole = np.arange(40) // 5, VaryingFactors(states, features, values, unsure)
    error = whole.left_out(groups) - values
    assert 0.03 < error.std() < 0.2
    assert np.abs(whole.left_out(groups)[:5] - values[:5]).max() > np.abs(
        [told(whole, states, s, f) - v for s, f, v in zip(states[:5], features[:5], values[:5])]).max()


def test_what_is_less_sure_counts_less():
    states, features, values, unsure = made(60)
    values[:10] += 3.0
    unsure[:10] = 100.0
    assert told(VaryingFactors(states, features, values, unsure), states, np.zeros(2), np.array([1.0, 0.0])) == pytest.approx(2, abs=0.1)


def test_values_that_are_all_zero_have_no_factors():
    states, features, values, unsure = made(20)
    assert np.abs(VaryingFactors(states, features, 0 * values, unsure).dual).max() < 1e-9
