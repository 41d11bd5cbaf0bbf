# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels of a contact's load and slip (src/taxel/taxel_load.cpp) against NumPy."""
import numpy as np
import pytest
from tactile_perception._core import taxel_lagging, taxel_load, taxel_spread, taxel_without_traction

SIZES = [(1, 1), (1, 9), (7, 1), (13, 6), (44, 44)]


def pressed(seed, size):
    """Random pressure, some of it negative, and touched taxels."""
    rng = np.random.default_rng(seed)
    return rng.normal(2e4, 2e4, size).astype(np.float32), rng.random(size) < 0.4


@pytest.mark.parametrize('size', SIZES)
@pytest.mark.parametrize('around', [0, 1, 3, 60])
def test_load_and_its_place(size, around):
    pressure, touched = pressed(around, size)
    touched &= np.random.default_rng(7).random(size) < 0.2
    padded = np.pad(touched, around)
    near = np.array([[padded[r:r + 2 * around + 1, c:c + 2 * around + 1].any() for c in range(size[1])] for r in range(size[0])])
    row, column = np.nonzero(near)
    load = pressure[row, column].astype(float)
    place = [load @ row / load.sum(), load @ column / load.sum()] if load.sum() > 0 else [np.nan, np.nan]
    assert taxel_load(pressure, touched, around=around) == pytest.approx([load.sum(), *place, len(row)], rel=1e-9, nan_ok=True)


@pytest.mark.parametrize('size', SIZES)
@pytest.mark.parametrize('direction', [(1.0, 0.0), (0.0, 2.0), (-0.6, 0.8)])
def test_spread_of_the_load_over_that_of_the_area(size, direction):
    pressure, touched = pressed(5, size)
    row, column = np.nonzero(touched)
    along, load = direction[0] * column + direction[1] * row, np.maximum(pressure[row, column], 0).astype(float)
    expected = np.nan
    if load.sum() > 0 and np.ptp(along) > 0:
        expected = (load @ (along - load @ along / load.sum())**2) / load.sum() / along.var()
    assert taxel_spread(pressure, touched, np.array(direction)) == pytest.approx(expected, rel=1e-9, nan_ok=True)


@pytest.mark.parametrize('size', SIZES)
def test_traction_doubles_or_cancels_a_pressure_at_most(size):
    pressure, _ = pressed(3, size)
    traction = np.random.default_rng(4).normal(0, 8e4, size).astype(np.float32)
    bound = np.maximum(pressure, 0)
    np.testing.assert_array_equal(taxel_without_traction(pressure, traction, unit=2.5),
                                  pressure - np.clip(traction / np.float32(2.5), -bound, bound))


@pytest.mark.parametrize('size', SIZES)
@pytest.mark.parametrize('frames', [0, 1, 3])
def test_what_lags_is_what_slips_by_a_part_of_the_motion(size, frames):
    rng, touched, motion = np.random.default_rng(frames), pressed(1, size)[1], np.array([2e-4, -1e-4, 0.02])
    slips = [rng.normal(0, 2e-5, (2, *size)).astype(np.float32) for _ in range(frames)]
    y, x = 1e-3 * (np.mgrid[:size[0], :size[1]] - 0.5 * (np.array(size) - 1)[:, None, None])
    lag = sum(slips, np.zeros((2, *size), np.float32))
    expected = touched & (np.hypot(*lag) > 0.1 * np.hypot(motion[0] - motion[2] * y, motion[1] + motion[2] * x))
    np.testing.assert_array_equal(taxel_lagging(slips, touched, motion, pitch=1e-3, part=0.1), expected)
