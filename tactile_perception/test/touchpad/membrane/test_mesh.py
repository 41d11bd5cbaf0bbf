# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument
from tactile_perception.touchpad.membrane.mesh import GridMesh


def test_a_grid_too_small_is_refused():
    with pytest.raises(BadArgument, match='3 x 3'):
        GridMesh(2, 9)


def test_a_hole_is_filled_as_a_soap_film_and_the_known_dots_stay():
    mesh = GridMesh(7, 7)
    row, column = np.divmod(np.arange(49), 7)
    plane = np.stack([row * 1.0, 2.0 * column - row], axis=1)
    known = ~(((row >= 2) & (row <= 4)) & ((column == 3) | (column == 4)))
    filled = mesh.fill(np.where(known[:, None], plane, np.nan), known)
    np.testing.assert_allclose(filled, plane, atol=0.6)
    np.testing.assert_array_equal(filled[known], plane[known])
