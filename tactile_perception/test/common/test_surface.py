# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The surface through dots, regions on it, and normals, displacements and forces at its points."""
import numpy as np
import pytest
from tactile_perception.common.surface import DotSurface, fill_unseen, grid_normals, region_outlines, to_grid
from tactile_perception.common.surface_points import STICKING, SurfacePoints, dot_points, scattered_normals
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


RADIUS = 0.15


def on_a_sphere(count, seed=3, reach=0.8):
    """Places (count, 3), m, spread evenly and at random over the upper part of a sphere about the origin."""
    rng = np.random.default_rng(seed)
    z, turn = rng.uniform(reach, 1, count), rng.uniform(0, 2 * np.pi, count)
    flat = np.sqrt(1 - z**2)
    return RADIUS * np.column_stack([flat * np.cos(turn), flat * np.sin(turn), z])


def degrees_off(found, true):
    return np.degrees(np.arccos(np.clip(np.sum(found * true, axis=1), -1, 1)))


def test_normals_of_scattered_points_of_a_sphere():
    places = on_a_sphere(300)
    off = degrees_off(scattered_normals(places), places / RADIUS)
    assert np.median(off) < 1.5 and np.percentile(off, 95) < 5.0


def test_normals_of_scattered_points_of_a_plane_are_exact_and_upward():
    rng = np.random.default_rng(1)
    xy = rng.uniform(-0.1, 0.1, (60, 2))
    true = np.array([0.3, -0.2, 1.0]) / np.linalg.norm([0.3, -0.2, 1.0])
    places = np.column_stack([xy, -(xy @ true[:2]) / true[2]])
    assert degrees_off(scattered_normals(places), np.tile(true, (60, 1))).max() < 1e-4


@pytest.mark.parametrize('count', [0, 1, 3])
def test_too_few_points_have_no_normal(count):
    assert np.isnan(scattered_normals(np.random.default_rng(0).normal(size=(count, 3)))).all()


def test_a_point_without_a_place_has_no_normal_and_spoils_no_other():
    places = on_a_sphere(300)
    places[[5, 90]] = np.nan
    found = scattered_normals(places)
    assert np.flatnonzero(np.isnan(found).any(axis=1)).tolist() == [5, 90]


def test_dots_of_a_grid():
    """A sheet that has been lowered and tilted: all is known in closed form."""
    row, column = np.divmod(np.arange(20), 5)
    rest = np.column_stack([0.01 * column, 0.01 * row, np.zeros(20)])
    now = rest + [0.0, 0.0, 1.0] * (0.5 * rest[:, :1] - 0.002)
    force = np.tile([0.1, 0.0, -0.2], (20, 1))
    points = dot_points((4, 5), now, rest, np.full(20, STICKING, np.uint8), force)
    true = np.array([-0.5, 0, 1.0]) / np.hypot(0.5, 1)
    assert points.normal == pytest.approx(np.tile(true, (20, 1))) and points.displacement == pytest.approx(now - rest)
    assert points.normal_force == pytest.approx(np.full(20, 0.25 / np.hypot(0.5, 1)))


def test_arrays_that_differ_in_length_are_refused():
    three = np.zeros((4, 3))
    with pytest.raises(BadArgument, match=r'force must be \(4, 3\) for 2 x 2 points'):
        SurfacePoints((2, 2), three, three, three, three[:2], np.zeros(4), np.zeros(4, np.uint8))
