# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Neighbours on the grid: curvature, smoothing and normals of shapes whose own are known."""
import numpy as np
import pytest
from tactile_perception.touchpad.optics.grid_derivatives import laplacian, normals, smooth


def test_bend_of_a_paraboloid_is_constant_and_zero_beside_gaps():
    y, x = np.mgrid[0:7, 0:7].astype(float)
    grid = 0.5 * (3 * x**2 + 5 * y**2)
    grid[3, 3] = np.nan
    out = laplacian(grid)
    assert out[1, 1] == pytest.approx(8.0)
    assert out[3, 3] == 0 and out[3, 2] == 0 and out[0, 3] == 0


def test_smoothing_keeps_a_plane_and_fills_a_gap():
    y, x = np.mgrid[0:7, 0:7].astype(float)
    grid = 2 * x - y
    grid[3, 3] = np.nan
    assert smooth(grid)[1:-1, 1:-1][0, 0] == pytest.approx(1.0)
    assert smooth(grid)[3, 3] == pytest.approx(3.0)


def test_normals_of_a_sphere_and_where_neighbours_are_missing():
    y, x = np.mgrid[-4:5, -4:5] * 1e-3
    places = np.stack([x, y, np.sqrt(0.02**2 - x**2 - y**2)])
    true = places / 0.02
    places[:, 4, 4] = np.nan
    otherwise = np.full_like(true, 7.0)
    found = normals(places, otherwise)
    assert found[:, 2, 2] == pytest.approx(true[:, 2, 2], abs=1e-3)
    assert found[:, 4, 3] == pytest.approx(otherwise[:, 4, 3])
