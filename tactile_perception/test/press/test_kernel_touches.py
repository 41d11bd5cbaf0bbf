# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel of src/press/sheet_view.cpp against the balance that it solves."""
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from tactile_perception._core import sheet_depths

SEEDS = st.integers(0, 2**32 - 1)


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
