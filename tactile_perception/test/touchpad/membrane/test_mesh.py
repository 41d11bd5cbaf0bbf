# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from scipy.linalg import cho_solve_banded, cholesky_banded
from tactile_perception.errors import BadArgument
from tactile_perception.touchpad.membrane.mesh import GridMesh


def test_a_grid_too_small_is_refused():
    with pytest.raises(BadArgument, match='3 x 3'):
        GridMesh(2, 9)


def test_each_cell_is_covered_twice_by_triangles_that_turn_the_same_way():
    mesh = GridMesh(4, 5)
    row, column = np.divmod(mesh.triangles, 5)
    area = ((column[1] - column[0]) * (row[2] - row[0]) - (row[1] - row[0]) * (column[2] - column[0])) / 2
    assert mesh.triangles.shape == (3, 4 * 3 * 4)
    np.testing.assert_array_equal(area, 0.5)


def test_the_band_solves_the_normal_equations_of_a_stencil_matrix():
    mesh, rng = GridMesh(5, 6), np.random.default_rng(0)
    rows = np.where(mesh.inner, rng.normal(size=(9, 30)), 0)
    dense = np.zeros((30, 30))
    np.add.at(dense, (np.arange(30)[None].repeat(9, 0), mesh.stencil), rows)
    weights, right = rng.random(30), rng.normal(size=30)
    matrix = dense.T @ (weights[:, None] * dense) + np.eye(30)
    band = mesh.normal_band(rows, weights)
    band[0] += 1
    found = cho_solve_banded((cholesky_banded(band, lower=True), True), mesh.transpose(rows, right))
    np.testing.assert_allclose(found, np.linalg.solve(matrix, dense.T @ right), atol=1e-9)


def test_a_hole_is_filled_as_a_soap_film_and_the_known_dots_stay():
    mesh = GridMesh(7, 7)
    row, column = np.divmod(np.arange(49), 7)
    plane = np.stack([row * 1.0, 2.0 * column - row], axis=1)
    known = ~(((row >= 2) & (row <= 4)) & ((column == 3) | (column == 4)))
    filled = mesh.fill(np.where(known[:, None], plane, np.nan), known)
    np.testing.assert_allclose(filled, plane, atol=0.6)
    np.testing.assert_array_equal(filled[known], plane[known])
