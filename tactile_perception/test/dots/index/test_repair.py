# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.dots.index.repair import complete_grid

SHAPE = (8, 10)


@pytest.fixture
def pressed():
    """(80, 2) places of a grid of pitch 40 px whose corner is pressed aside: steps from 60 px down to 12."""
    row, column = np.divmod(np.arange(80), 10)
    squeezed = np.r_[np.arange(7) * 40, 300, 340, 352]
    v = row * 40 - 25 * np.exp(-((column - 8)**2 + row**2) / 4)
    return np.stack([np.where(row < 4, squeezed[column], column * 40), v], 1).astype(float)


def test_the_dots_left_get_the_numbers_left(pressed):
    rng = np.random.default_rng(0)
    order = rng.permutation(80)
    row, column = np.divmod(order, 10)
    id = np.where((row < 3) & (column > 6), -1, order)
    assert np.array_equal(complete_grid(id, pressed[order], SHAPE), order)


def test_nothing_is_guessed(pressed):
    id = np.arange(80)
    assert complete_grid(id, pressed, SHAPE) is id  # nothing left
    some = np.where(id < 3, -1, id)
    assert complete_grid(some[1:], pressed[1:], SHAPE)[0] == -1  # a dot is not seen: which of three?
    false = np.vstack([pressed[0], pressed])
    assert complete_grid(np.r_[-1, id], false, SHAPE)[0] == -1
    many = np.where(id < 20, -1, id)
    assert np.array_equal(complete_grid(many, pressed, SHAPE), many)


def test_a_mesh_turned_over_is_no_answer(pressed):
    uv = pressed.copy()
    uv[0] = [100, 90]  # beyond its neighbours
    id = np.arange(80)
    id[0] = -1
    assert complete_grid(id, uv, SHAPE)[0] == -1


def test_a_false_dot_where_the_grid_is_even_gets_no_number():
    for place in (75, 40, 9):
        row, column = np.divmod(np.arange(80), 10)
        uv = np.stack([column * 40.0, row * 40.0], 1) + np.random.default_rng(place).normal(0, 0.3, (80, 2))
        uv[place] += [9, 6]
        assert complete_grid(np.where(np.arange(80) == place, -1, np.arange(80)), uv, SHAPE)[place] == -1
