# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels of a taxel's response and its hysteresis (src/taxel/taxel_response.cpp) against NumPy."""
import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tactile_perception._core import taxel_pressure, taxel_undone

SIZES = [(1, 1), (1, 9), (7, 1), (13, 6), (44, 44)]
NUMBERS = st.floats(0, 1e6, allow_subnormal=False)


@given(seed=st.integers(0, 99), size=st.sampled_from(SIZES), scale=st.tuples(NUMBERS, NUMBERS, NUMBERS), knee=st.floats(1e-3, 1e3))
def test_the_curve_of_the_response(seed, size, scale, knee):
    rng = np.random.default_rng(seed)
    change, by_gain = rng.normal(0, 100, size).astype(np.float32), rng.uniform(0.5, 2, size).astype(np.float32)
    value = change.astype(float) * by_gain
    expected = scale[0] * value + scale[1] * value * abs(value) + scale[2] * value * knee / (abs(value) + knee)
    np.testing.assert_allclose(taxel_pressure(change, by_gain, scale=scale, knee=knee), expected, rtol=1e-5, atol=1e-20)


def held_after(load, held, reach, relative):
    """The held load of one taxel: it follows a load that is farther than its reach."""
    most = reach + relative * max(load, 0.0)
    return min(max(held, load - most), load + most)


def load_behind(shown, held, share, reach, relative):
    """The load, by bisection, of which the layer shows just that: what it shows rises with the load."""
    low, high = -1e6, 1e6
    for _ in range(80):
        middle = 0.5 * (low + high)
        more = (1 - share) * middle + share * held_after(middle, held, reach, relative) < shown
        low, high = (middle, high) if more else (low, middle)
    return 0.5 * (low + high)


@pytest.mark.parametrize('size', SIZES[:-1])
@pytest.mark.parametrize('share, reach, relative, crept', [(0.0, 0.0, 0.0, 0.0), (0.5, 30.0, 0.0, 0.0), (0.12, 90.0, 0.3, 0.2),
                                                          (0.9, 0.0, 1.0, 1.0), (0.5, 1e5, 0.0, 0.1)])
def test_the_load_behind_what_a_layer_shows(size, share, reach, relative, crept):
    rng = np.random.default_rng(2)
    pressure, last, held = rng.normal(0, [[[100]], [[100]], [[150]]], (3, *size)).astype(np.float32)
    held.flat[0] = np.nan
    before = np.where(np.isnan(held), pressure, held + np.float32(crept) * (last - held))
    loads = np.array([load_behind(p, h, share, reach, relative) for p, h in zip(pressure.ravel(), before.ravel())]).reshape(size)
    follows = np.array([held_after(p, h, reach, relative) for p, h in zip(loads.ravel(), before.ravel())]).reshape(size)
    load, found = taxel_undone(pressure, last, held, share=share, reach=reach, relative=relative, crept=crept, smooth=1.0)
    np.testing.assert_allclose(found, follows, rtol=1e-4, atol=1e-2)
    hidden = cv2.GaussianBlur((loads - pressure).astype(np.float32), (9, 9), 1.0, borderType=cv2.BORDER_REPLICATE)
    np.testing.assert_allclose(load, pressure + hidden, rtol=1e-4, atol=2e-2)


def test_what_is_unknown_spreads_no_farther_than_the_gaussian_and_changes_no_held_load():
    pressure = np.zeros((12, 12), np.float32)
    pressure[0, 0] = np.nan
    zero = np.zeros_like(pressure)
    load, held = taxel_undone(pressure, zero, zero, share=0.5, reach=1.0, relative=0.0, crept=0.0, smooth=1.0)
    assert (held == 0).all()
    assert np.isnan(load[:5, :5]).all() and (load[5:, 5:] == 0).all()
