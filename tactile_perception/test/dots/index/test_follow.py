# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.dots.index.follow import follow

ROWS, COLUMNS, PITCH = 10, 12, 20.0


@pytest.fixture
def grid():
    row, column = np.divmod(np.arange(ROWS * COLUMNS), COLUMNS)
    return np.stack([column, row], axis=1) * PITCH + 30.0, np.arange(ROWS * COLUMNS)


def test_small_moves_keep_numbers(grid):
    uv, id = grid
    order = np.random.default_rng(0).permutation(len(uv))
    np.testing.assert_array_equal(follow(uv[order] + [2.0, -3.0], uv, id, (ROWS, COLUMNS), PITCH), id[order])


@pytest.mark.parametrize('pitches', [(1, 0), (0, 1), (-1, 0), (0, -3), (2, 2), (0.5, 0)])
def test_a_move_by_whole_pitches_is_noticed(grid, pitches):
    uv, id = grid
    assert follow(uv + PITCH * np.array(pitches), uv, id, (ROWS, COLUMNS), PITCH) is None


def test_a_part_that_moved_by_a_pitch_is_noticed(grid):
    uv, id = grid
    middle = uv.mean(axis=0)
    near = np.exp(-((uv - middle) ** 2).sum(axis=1) / (2 * (2.5 * PITCH) ** 2))
    assert follow(uv + np.outer(near, [PITCH, 0]), uv, id, (ROWS, COLUMNS), PITCH) is None


def test_a_dot_comes_back_and_a_false_one_gets_no_number(grid):
    uv, id = grid
    known = np.delete(np.arange(len(uv)), 40)
    now = np.vstack([uv, [[35.0, 5.0]]])
    numbers = follow(now, uv[known], id[known], (ROWS, COLUMNS), PITCH)
    np.testing.assert_array_equal(numbers, np.r_[id, -1])


def test_an_outer_row_gone_is_not_certain(grid):
    uv, id = grid
    assert follow(uv[uv[:, 1] > 40], uv, id, (ROWS, COLUMNS), PITCH) is None
