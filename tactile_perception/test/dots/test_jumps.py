# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.dots.jumps import leave_out_jumps

ROW, COLUMN = np.divmod(np.arange(80), 10)
UV, ID = np.stack([COLUMN, ROW], axis=1) * 20.0, np.arange(80)


def test_an_even_grid_keeps_its_numbers():
    np.testing.assert_array_equal(leave_out_jumps(ID, UV, (8, 10)), ID)


def test_a_smooth_compression_to_0_6_is_no_jump():
    u = UV[:, 0]
    squeezed = np.stack([u - 0.4 * (u - 90) * np.exp(-((u - 90) ** 2) / (2 * 60**2)), UV[:, 1]], axis=1)
    np.testing.assert_array_equal(leave_out_jumps(ID, squeezed, (8, 10)), ID)


def test_a_dot_under_its_neighbours_number_loses_it():
    seen = np.delete(ID, 44)
    id = seen.copy()
    id[seen == 45] = 44  # dot 44 is missing, and 45 took its number
    cleaned = leave_out_jumps(id, UV[seen], (8, 10))
    assert cleaned[seen == 45] == -1
    assert np.count_nonzero(cleaned >= 0) >= 60
    assert set(cleaned[cleaned >= 0]) <= set(ID) - {44}


@pytest.mark.parametrize('place', [45, 5])
def test_a_merged_dot_that_stands_beside_a_missing_one_loses_its_number(place):
    seen = np.delete(ID, place - 1)
    uv = UV[seen]
    uv[seen == place] -= [6.5, 0.0]
    cleaned = leave_out_jumps(seen, uv, (8, 10))
    np.testing.assert_array_equal(cleaned, np.where(seen == place, -1, seen))


def test_no_numbers():
    assert np.all(leave_out_jumps(np.full(3, -1), np.zeros((3, 2)), (8, 10)) == -1)
