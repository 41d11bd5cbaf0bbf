# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
from tactile_perception.dots.index.published import number_by_paper


def whole(rows=7, columns=9, pitch=20.0, size=(240, 200)):
    row, column = np.divmod(np.arange(rows * columns), columns)
    return np.stack([column - (columns - 1) / 2, row - (rows - 1) / 2], axis=1) * pitch + (np.array(size) - 1) / 2, size


def test_a_whole_grid_at_rest():
    uv, size = whole()
    order = np.random.default_rng(0).permutation(len(uv))
    id, reason = number_by_paper(uv[order], (7, 9), size)
    assert reason == ''
    np.testing.assert_array_equal(id, order)


def test_a_gap_in_the_middle_row_stops_it():
    uv, size = whole()
    id, reason = number_by_paper(np.delete(uv, [3 * 9 + 2, 3 * 9 + 4], axis=0), (7, 9), size)
    assert np.all(id == -1) and 'meet in 0 dots' in reason


def test_a_shift_by_a_pitch_misnumbers_all():
    uv, size = whole()
    id, _ = number_by_paper(uv + [20.0, 0.0], (7, 9), size)
    assert np.all(id != np.arange(63))  # it starts from fixed points: why number_grid does not


def test_too_few_dots():
    assert number_by_paper(np.zeros((3, 2)), (7, 9), (240, 200))[1] == 'only 3 dots found'
