# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels of src/press/touch_region.cpp and sheet_depths.cpp against NumPy."""
import numpy as np
import pytest
import touch_reference as reference
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import sheet_depths, touch_region

SEEDS = st.integers(0, 2**32 - 1)
SHEET, DOME = {'size': (0.06, 0.045), 'rim': 0.0, 'height': 0.0}, {'size': (0.0, 0.0), 'rim': 0.15, 'height': 0.117}






@given(seed=SEEDS, count=st.integers(0, 3), skin=st.sampled_from([SHEET, DOME]), lost=st.floats(0, 0.5))
@settings(max_examples=150, deadline=None)
def test_the_region_is_that_of_discs(seed, count, skin, lost):
    rng = np.random.default_rng(seed)
    reach = np.array(skin['size']) if min(skin['size']) > 0 else np.full(2, 0.2)
    tips = np.column_stack([rng.uniform(-0.6, 0.6, (count, 2)) * reach, rng.uniform(-0.01, 0.1, count), rng.uniform(0, 0.02, count),
                            rng.uniform(2e-3, 0.03, count)])
    rest, shift = rng.uniform(-0.5, 0.5, (50, 2)) * reach, rng.normal(0, 1e-3, (50, 2))
    shift[rng.random(50) < lost] = np.nan
    eye = rng.normal(0, 2e-3, (50, 3)) - [0, 0, 0.06]
    id, state, discs, outlines = touch_region(tips, rest, shift, eye, size=skin['size'], rim_radius=skin['rim'], height=skin['height'],
                                              plane=skin['height'])
    expected = [reference.disc(tip, *skin.values()) for tip in tips]
    assert discs == pytest.approx(np.array([np.hstack(one) for one in expected]).reshape(-1, 7), rel=1e-9, abs=1e-12)
    assert outlines == pytest.approx(np.array([reference.outline(*one) for one in expected]).reshape(-1, 36, 3), rel=1e-9, abs=1e-12)
    seen, under = reference.under(expected, rest, shift, eye, skin['height'])
    np.testing.assert_array_equal(id, seen)
    np.testing.assert_array_equal(state, under)


@given(seed=SEEDS, markers=st.integers(1, 40))
@settings(max_examples=100, deadline=None)
def test_depths_balance_strain_and_bending(seed, markers):
    rng = np.random.default_rng(seed)
    bending, strain = (parts @ parts.T + 0.1 * np.eye(markers) for parts in rng.normal(0, 1, (2, markers, markers)))
    slope, shift = rng.normal(0, 1, (markers, 2)), rng.normal(0, 1e-3, (markers, 2))
    depth = sheet_depths(bending, strain, slope, shift)
    held = bending @ depth + sum(slope[:, axis] * (strain @ (slope[:, axis] * depth - shift[:, axis])) for axis in (0, 1))
    assert held == pytest.approx(0.0, abs=1e-9) and depth.shape == (markers,)


def test_depths_without_a_balance_are_unknown():
    assert np.isnan(sheet_depths(-np.eye(3), np.eye(3), np.zeros((3, 2)), np.ones((3, 2)))).all()
