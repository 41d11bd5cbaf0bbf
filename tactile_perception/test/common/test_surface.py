# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The surface through dots, and regions on it."""
import numpy as np
import pytest
from tactile_perception.common.surface import DotSurface, fill_unseen, grid_normals, region_outlines, to_grid
from tactile_perception.errors import BadArgument


@pytest.mark.parametrize('ids', [[0, 6], [-1, 2], [1, 1]])
def test_refuses_ids_off_the_grid(ids):
    with pytest.raises(BadArgument):
        to_grid(np.array(ids), np.zeros(2), 2, 3)


def test_slopes_are_central_and_one_sided_at_gaps():
    column, row = np.meshgrid(np.arange(5.0), np.arange(2.0))
    normal = grid_normals(np.stack([column, row, np.tile([0.0, 1, 4, np.nan, 16], (2, 1))], axis=-1))
    np.testing.assert_allclose(-normal[..., 0] / normal[..., 2], np.tile([1, 2, 3, np.nan, np.nan], (2, 1)), rtol=1e-12)
    assert np.isnan(grid_normals(np.stack([column, row, column], axis=-1)[:1])).all()  # nothing tells the slope by row


def test_fills_a_plane_exactly():
    row, column = np.mgrid[:6, :7]
    plane = 2.0 * row - 3 * column
    holed = plane.copy()
    holed[2:4, 3] = holed[0, 0] = holed[5, 6] = np.nan
    np.testing.assert_allclose(fill_unseen(holed), plane)


def test_fill_ends_where_nothing_is_known():
    assert np.isnan(fill_unseen(np.full((4, 4), np.nan))).all()
    np.testing.assert_array_equal(fill_unseen(np.where(np.eye(3) > 0, 1.0, np.nan)), 1)


def test_points_lie_on_the_cap(pad):
    surface = DotSurface(pad.rest.reshape(23, 23, 3))
    places = np.random.default_rng(0).uniform(4, 18, (200, 2))
    points = surface.points(places)
    np.testing.assert_allclose(points[:, 0], (places[:, 1] - 11) * pad.pitch, atol=1e-12)
    assert np.abs(points[:, 2] - pad.cap.heights(points[:, :2])).max() < 1e-6


def test_unseen_dots_are_continued(pad):
    grid = pad.rest.reshape(23, 23, 3).copy()
    true = grid[10, 12].copy()
    grid[10, 12] = np.nan
    assert np.linalg.norm(DotSurface(grid).xyz[10, 12] - true) < 40e-6


def test_refuses_what_is_no_surface():
    with pytest.raises(BadArgument):
        DotSurface(np.full((23, 23, 3), np.nan))


def flat(rows=23, columns=23):
    row, column = np.mgrid[:rows, :columns].astype(float)
    return DotSurface(np.stack([column, row, np.zeros_like(row)], axis=2))


def test_hard_edge_does_not_push_the_outline():
    score = np.zeros((23, 23))
    score[5:15, 5:15] = 1
    pressed = score.copy()
    pressed[5:15, 5] = 9
    a, b = (region_outlines(values, flat())[0][0] for values in (score, pressed))
    np.testing.assert_allclose(a.points, b.points)


def test_region_at_the_border_closes_half_a_pitch_outside():
    score = np.zeros((23, 23))
    score[:4, :5] = 1
    region, = region_outlines(score, flat())[0]
    assert region.points[:, :2].min(axis=0) == pytest.approx([-0.5, -0.5], abs=0.04)


def test_unseen_dots_leave_no_hole():
    row, column = np.mgrid[:23, :23]
    score = np.clip(6.5 - np.hypot(row - 11, column - 11), 0, 1)
    score[11, 11] = score[10, 14] = np.nan
    region, = region_outlines(score, flat())[0]
    assert not region.holes
