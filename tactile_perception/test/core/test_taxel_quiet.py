# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels taxel_follow and taxel_responding (src/taxel/taxel_quiet.cpp) against NumPy, bit by bit."""
import numpy as np
import pytest
from scipy import ndimage
from tactile_perception._core import taxel_follow, taxel_responding

SIZES = [(1, 1), (1, 9), (7, 1), (3, 3), (13, 6), (44, 44)]


@pytest.mark.parametrize('size', SIZES)
@pytest.mark.parametrize('seed', range(4))
def test_untouched_values_follow_what_is_quiet(size, seed):
    rng = np.random.default_rng(seed)
    values, change = rng.normal(0, 5, (2, *size)).astype(np.float32)
    change[rng.random(size) < 0.1] = rng.choice([np.nan, np.inf, -np.inf])
    count, touched = rng.integers(0, 20, size).astype(np.float32), rng.random(size) < 0.01 * seed
    quiet = np.isfinite(change) & ~ndimage.maximum_filter(touched, 7, mode='constant')
    seen = count + quiet.astype(np.float32)
    with np.errstate(all='ignore'):
        gain = np.where(seen <= 10, np.float32(1) / seen, np.float32(0.1))
        expected = np.where(quiet, values + change * gain, values)
    found = taxel_follow(values, count, change, touched, around=3, frames=10, gain=0.1)
    for one, other in zip(found, (expected, seen, quiet)):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize('size', SIZES)
@pytest.mark.parametrize('seed', range(4))
def test_a_taxel_is_silent_between_two_that_respond(size, seed):
    rng = np.random.default_rng(seed)
    change = rng.choice(np.array([0, 0.3, 1, 2, 30, np.nan], np.float32), size, p=[0.1, 0.1, 0.1, 0.3, 0.3, 0.1])
    responded = rng.random(size) < 0.2
    now, silent = taxel_responding(change, responded, pressed=1.5, part=0.2)
    np.testing.assert_array_equal(now, responded | (change > 1.5))
    around = np.pad(np.where(change > 1.5, change, 0), 1)
    for r, c in np.ndindex(size):
        least = max(min(around[r, c + 1], around[r + 2, c + 1]), min(around[r + 1, c], around[r + 1, c + 2]))
        assert silent[r, c] == (least > 0 and not now[r, c] and change[r, c] < np.float32(0.2) * least)
