# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.dots.index.grid import Numbered
from tactile_perception.dots.index.methods import METHODS, numbering_method
from tactile_perception.errors import BadArgument


@pytest.fixture
def grid():
    row, column = np.divmod(np.arange(63), 9)
    return np.stack([column, row], axis=1) * 20.0 + 39.5


@pytest.mark.parametrize('name', METHODS)
def test_each_method_numbers_a_still_grid(name, grid):
    numbers = numbering_method(name)(grid + 1.0, 7, 9, Numbered(grid, np.arange(63)), (240, 200))
    np.testing.assert_array_equal(numbers.id, np.arange(63))


def test_an_unknown_name_lists_the_known():
    with pytest.raises(BadArgument, match="'walk' is unknown: choose from lattice, paper, nearest"):
        numbering_method('walk')


def test_nearest_is_one_to_one_and_wrong_after_a_pitch(grid):
    numbers = METHODS['nearest'](grid + [21.0, 0.0], 7, 9, Numbered(grid, np.arange(63)))
    given = numbers.id[numbers.id >= 0]
    assert len(np.unique(given)) == len(given)
    assert np.mean(numbers.id == np.arange(63)) == 0


def test_the_paper_needs_the_size_of_the_image(grid):
    with pytest.raises(BadArgument, match='image_size'):
        METHODS['paper'](grid, 7, 9)
