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


@pytest.mark.parametrize('size', SIZES)
@pytest.mark.parametrize('width, crept', [(0.0, 0.0), (30.0, 0.0), (30.0, 0.2), (1e5, 1.0)])
def test_the_load_behind_what_a_layer_shows(size, width, crept):
    rng = np.random.default_rng(2)
    pressure, last, hidden = rng.normal(0, [[[100]], [[100]], [[20]]], (3, *size)).astype(np.float32)
    stays = np.clip(hidden + (pressure - last) - 2 * crept * hidden, -width, width)
    load, found = taxel_undone(pressure, last, hidden, width=width, crept=crept, smooth=1.0)
    np.testing.assert_allclose(found, stays, rtol=1e-5, atol=1e-4)
    np.testing.assert_allclose(load, pressure + cv2.GaussianBlur(stays, (9, 9), 1.0, borderType=cv2.BORDER_REPLICATE), rtol=1e-4, atol=1e-3)


def test_what_is_unknown_stays_unknown_and_spreads_no_farther_than_the_gaussian():
    pressure = np.zeros((12, 12), np.float32)
    pressure[0, 0] = np.nan
    load, hidden = taxel_undone(pressure, np.zeros_like(pressure), np.zeros_like(pressure), width=1.0, crept=0.0, smooth=1.0)
    assert np.isnan(hidden[0, 0]) and np.isfinite(hidden).sum() == 143
    assert np.isnan(load[:5, :5]).all() and (load[5:, 5:] == 0).all()
