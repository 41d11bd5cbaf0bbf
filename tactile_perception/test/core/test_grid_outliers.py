# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel reject_outliers (src/dots/index/grid_outliers.cpp): grids with wrong indices, and the same in NumPy, one step at a time."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import reject_outliers


def off(places, axis):
    """Relative deviation (rows, columns) of each step from a dot to the next along the axis from the mean of 5 x 5 around it."""
    step = np.full_like(places, np.nan)
    inner = (slice(0, -1), slice(None)) if axis == 0 else (slice(None), slice(0, -1))
    step[inner] = np.diff(places, axis=axis)
    found = np.full(places.shape[:2], np.nan)
    for r, c in np.argwhere(np.isfinite(step[:, :, 0])):
        mean = np.nanmean(step[max(r - 2, 0):r + 3, max(c - 2, 0):c + 3].reshape(-1, 2), axis=0)
        found[r, c] = np.linalg.norm(step[r, c] - mean) / max(np.linalg.norm(mean), 1e-9)
    return found


def reference(id, uv, rows, columns):
    places = np.full((rows, columns, 2), np.nan)
    places[np.divmod(id[id >= 0], columns)] = uv[id >= 0]
    bad, held = np.zeros((rows, columns), bool), np.zeros((rows, columns), bool)
    for axis in (0, 1):
        deviation = off(places, axis)
        for r, c in np.argwhere(np.isfinite(deviation)):
            for at in ((r, c), (r + 1, c) if axis == 0 else (r, c + 1)):
                bad[at] |= deviation[r, c] > 0.6
                held[at] |= deviation[r, c] < 0.25
    kept = id.copy()
    for k in np.flatnonzero(id >= 0):
        r, c = divmod(id[k], columns)
        if not held[r, c] or bad[max(r - 1, 0):r + 2, max(c - 1, 0):c + 2].any():
            kept[k] = -1
    return kept


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(1, 9), columns=st.integers(2, 9), lost=st.floats(0, 0.4), wrong=st.integers(0, 3))
@settings(max_examples=100, deadline=None)
def test_dots_rejected_are_those_of_one_step_at_a_time(seed, rows, columns, lost, wrong):
    rng = np.random.default_rng(seed)
    count = rows * columns
    uv = 20.0 * np.stack(np.divmod(np.arange(count), columns)[::-1], axis=1) + rng.normal(0, 1.5, (count, 2))
    uv[rng.integers(0, count, wrong)] += rng.normal(0, 12, 2)
    id = np.where(rng.random(count) < lost, -1, np.arange(count))
    order = rng.permutation(count)
    np.testing.assert_array_equal(reject_outliers(id[order], uv[order], rows=rows, columns=columns),
                                  reference(id[order], uv[order], rows, columns))


ROW, COLUMN = np.divmod(np.arange(80), 10)
UV, ID = np.stack([COLUMN, ROW], axis=1) * 20.0, np.arange(80)


def test_an_even_grid_keeps_its_numbers():
    np.testing.assert_array_equal(reject_outliers(ID, UV, rows=8, columns=10), ID)


def test_a_smooth_compression_to_0_6_is_no_outlier():
    u = UV[:, 0]
    squeezed = np.stack([u - 0.4 * (u - 90) * np.exp(-((u - 90) ** 2) / (2 * 60**2)), UV[:, 1]], axis=1)
    np.testing.assert_array_equal(reject_outliers(ID, squeezed, rows=8, columns=10), ID)


def test_a_dot_under_its_neighbours_number_loses_it():
    seen = np.delete(ID, 44)
    id = seen.copy()
    id[seen == 45] = 44  # dot 44 is missing, and 45 took its number
    cleaned = reject_outliers(id, UV[seen], rows=8, columns=10)
    assert cleaned[seen == 45] == -1
    assert np.count_nonzero(cleaned >= 0) >= 60
    assert set(cleaned[cleaned >= 0]) <= set(ID) - {44}


@pytest.mark.parametrize('place', [45, 5])
def test_a_merged_dot_that_stands_beside_a_missing_one_loses_its_number(place):
    seen = np.delete(ID, place - 1)
    uv = UV[seen]
    uv[seen == place] -= [6.5, 0.0]
    cleaned = reject_outliers(seen, uv, rows=8, columns=10)
    np.testing.assert_array_equal(cleaned, np.where(seen == place, -1, seen))


def test_no_numbers():
    assert np.all(reject_outliers(np.full(3, -1), np.zeros((3, 2)), rows=8, columns=10) == -1)


@pytest.mark.parametrize('wrong', [{'rows': 0}, {'columns': 10**6}])
def test_numbers_are_checked(wrong):
    with pytest.raises(ValueError, match=f'^{next(iter(wrong))}: '):
        reject_outliers(ID, UV, **({'rows': 8, 'columns': 10} | wrong))
