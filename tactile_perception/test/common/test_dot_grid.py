# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.dot_grid import fill_unseen, grid_normals, scatter, to_grid
from tactile_perception.errors import BadArgument


def test_lays_out_and_marks_unseen():
    grid = to_grid(np.array([0, 5]), np.array([1.0, 2.0]), 2, 3)
    np.testing.assert_array_equal(grid, [[1, np.nan, np.nan], [np.nan, np.nan, 2]])


def test_values_of_some_dots_among_all():
    assert scatter(np.array([1.5, 2.5]), np.array([3, 0]), 4) == pytest.approx([2.5, np.nan, np.nan, 1.5], nan_ok=True)
    assert scatter(np.array([1, 2], np.uint8), np.array([3, 0]), 4, 255).tolist() == [2, 255, 255, 1]
    components_first = np.arange(6.0).reshape(3, 2)
    assert scatter(components_first, np.array([3, 0]), 4, last=True)[:, [3, 0]].tolist() == components_first.tolist()


@pytest.mark.parametrize('ids', [[0, 6], [-1, 2], [1, 1]])
def test_refuses_ids_off_the_grid(ids):
    with pytest.raises(BadArgument):
        to_grid(np.array(ids), np.zeros(2), 2, 3)


def slopes(grid, axis):
    """Differences along an axis of grid (rows, columns, 3): central, one-sided next to a gap, NaN without neighbours."""
    before, after = np.full((2, *grid.shape), np.nan)
    step = np.diff(grid, axis=axis)
    inner = [slice(None)] * 3
    inner[axis] = slice(1, None)
    before[tuple(inner)] = step
    inner[axis] = slice(None, -1)
    after[tuple(inner)] = step
    return np.where(np.isnan(before), after, np.where(np.isnan(after), before, 0.5 * (before + after)))


@pytest.mark.parametrize('seed', range(5))
def test_normals_are_those_of_central_and_one_sided_differences(seed):
    rng = np.random.default_rng(seed)
    xyz = rng.normal(size=(*rng.integers(1, 9, 2), 3))
    xyz[rng.random(xyz.shape[:2]) < 0.3] = np.nan
    normal = np.cross(slopes(xyz, 1), slopes(xyz, 0))
    np.testing.assert_allclose(grid_normals(xyz), normal / np.linalg.norm(normal, axis=2, keepdims=True), rtol=1e-12)


def test_slopes_are_central_and_one_sided_at_gaps():
    column, row = np.meshgrid(np.arange(5.0), np.arange(2.0))
    normal = grid_normals(np.stack([column, row, np.tile([0.0, 1, 4, np.nan, 16], (2, 1))], axis=-1))
    np.testing.assert_allclose(-normal[..., 0] / normal[..., 2], np.tile([1, 2, 3, np.nan, np.nan], (2, 1)), rtol=1e-12)
    assert np.isnan(grid_normals(np.stack([column, row, column], axis=-1)[:1])).all()  # nothing tells the slope by row


def test_normals_of_a_sphere(pad):
    normals = grid_normals(pad.rest.reshape(23, 23, 3)).reshape(-1, 3)
    true = (pad.rest - [0, 0, pad.cap.centre_z]) / pad.cap.curvature_radius
    inner = np.hypot(*pad.rest[:, :2].T) < 10e-3
    assert np.degrees(np.arccos(np.sum(normals * true, axis=1)))[inner].max() < 1.0


def test_normals_are_nan_where_alone():
    xyz = np.full((3, 3, 3), np.nan)
    xyz[1, 1] = 0
    assert np.isnan(grid_normals(xyz)).all()


def test_fills_a_plane_exactly():
    row, column = np.mgrid[:6, :7]
    plane = 2.0 * row - 3 * column
    holed = plane.copy()
    holed[2:4, 3] = holed[0, 0] = holed[5, 6] = np.nan
    np.testing.assert_allclose(fill_unseen(holed), plane)


def test_fill_ends_where_nothing_is_known():
    assert np.isnan(fill_unseen(np.full((4, 4), np.nan))).all()
    np.testing.assert_array_equal(fill_unseen(np.where(np.eye(3) > 0, 1.0, np.nan)), 1)


def test_fill_from_few_dots_stays_near_them():
    grid = np.full((23, 23), np.nan)
    grid[10, 10:12] = [0.0, 1e-3]
    grid[11, 11] = 3e-3
    assert np.abs(fill_unseen(grid)).max() < 10e-3
