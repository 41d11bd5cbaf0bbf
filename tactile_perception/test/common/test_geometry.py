# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Rotations, poses of frames, vectors, caps and splines; what a camera sees; surfaces of dots, and their normals."""
import cv2
import numpy as np
import pytest
from scipy.interpolate import BSpline

from tactile_driver.lens import farthest_square
from tactile_perception._core.common import Camera
from tactile_perception._core.press import MarkerView
from tactile_perception.common.geometry import (
    Cap,
    FrameTree,
    are_collinear,
    deepest_notch,
    matrix_of_quaternion,
    quaternion,
    rotation_matrix,
    sphere_ranges,
    spline_fit,
    tangents,
)
from tactile_perception.common.surface import DotSurface, fill_unseen, grid_normals, region_outlines, to_grid
from tactile_perception.common.surface_points import STICKING, SurfacePoints, dot_points, scattered_normals
from tactile_perception.core.errors import BadArgument, BadFrame


@pytest.mark.parametrize('vector', [[0, 0, 0], [3.1, 0, 0], [0, -3.0, 0.2], [0.1, 0.2, 3.0], [1, 1, 1]])
def test_quaternion_is_that_of_the_rotation(vector):
    angle = np.linalg.norm(vector)
    axis = np.array(vector) / max(angle, 1e-9)
    found = quaternion(rotation_matrix(np.array(vector, float)))
    np.testing.assert_allclose(found, [*np.sin(angle / 2) * axis, np.cos(angle / 2)], atol=1e-9)
    np.testing.assert_allclose(matrix_of_quaternion(found), rotation_matrix(np.array(vector, float)), atol=1e-12)


@pytest.mark.parametrize('normal', [[0, 0, 1.0], [0, 1.0, 0], [-0.6, 0, 0.8]])
def test_tangents(normal):
    basis = np.vstack([tangents(np.array(normal)), normal])
    assert basis @ basis.T == pytest.approx(np.eye(3), abs=1e-12)


QUARTER = np.sqrt(0.5)
LEFT, STRAIGHT = [0, 0, QUARTER, QUARTER], [0, 0, 0, 1]  # a quarter turn about z, from x to y


def hand():
    """world -> wrist (a metre up, turned left) -> finger (10 cm along the wrist's x); world -> table."""
    tree = FrameTree()
    tree.take('world', 'wrist', LEFT, [0, 0, 1])
    tree.take('wrist', 'finger', STRAIGHT, [0.1, 0, 0])
    tree.take('world', 'table', STRAIGHT, [2, 0, 0])
    return tree


def at(tree, frame, reference, position=(0, 0, 0)):
    rotation, translation = tree.pose(frame, reference)
    return rotation @ position + translation


def test_up_down_and_across():
    tree = hand()
    assert at(tree, 'finger', 'world') == pytest.approx([0, 0.1, 1])
    assert at(tree, 'finger', 'world', (1, 0, 0)) == pytest.approx([0, 1.1, 1])
    assert at(tree, 'world', 'finger', (0, 0.1, 1)) == pytest.approx([0, 0, 0])
    assert at(tree, 'finger', 'table') == pytest.approx([-2, 0.1, 1])
    assert at(tree, 'finger', 'finger', (1, 2, 3)) == pytest.approx([1, 2, 3])


def test_the_newest_counts():
    tree = hand()
    before = tree.changes
    tree.take('world', 'wrist', STRAIGHT, [0, 0, 2])
    assert tree.changes == before + 1 and at(tree, 'finger', 'world') == pytest.approx([0.1, 0, 2])


def test_frames_that_do_not_hang_together():
    tree = hand()
    tree.take('map', 'robot', STRAIGHT, [0, 0, 0])
    assert tree.pose('finger', 'robot') is None and tree.pose('finger', 'nowhere') is None


def test_poses_between_two_instants():
    tree, turn = FrameTree(), np.array([0.1, -0.4, 0.9])
    tree.take('base', 'sensor', quaternion(rotation_matrix(turn)), [0.1, 0.2, 0.3])
    for k in range(2):
        tree.take('base', 'arm', quaternion(rotation_matrix(k * turn)), [0.1, 0.2, 0.3 + 0.1 * k], 10.0 + k)
        tree.take('arm', 'tip', STRAIGHT, [0, 0, 0.05], 10.0 + k)
    rotation, translation = tree.pose('tip', 'base', 10.25)
    assert rotation == pytest.approx(rotation_matrix(0.25 * turn))
    assert translation == pytest.approx([0.1, 0.2, 0.325] + rotation @ [0, 0, 0.05])
    assert at(tree, 'tip', 'sensor', (0, 0, -0.05)) == pytest.approx(rotation_matrix(-turn) @ [0, 0, 0.1]), 'the newest'
    assert [tree.pose('tip', 'sensor', stamp) is None for stamp in (9.9, 10.0, 11.0, 11.1)] == [True, False, False, True]
    before = tree.changes
    tree.take('base', 'arm', STRAIGHT, [9, 9, 9], 10.5)
    assert tree.changes == before and tree.frames == ['arm', 'base', 'sensor', 'tip']
    tree.take('world', 'arm', STRAIGHT, [0, 0, 0], 30.0)
    assert tree.pose('tip', 'base', 11.0) is None and tree.pose('tip', 'world') is not None


def test_a_circle_ends():
    tree = FrameTree()
    tree.take('a', 'b', STRAIGHT, [1, 0, 0])
    tree.take('b', 'a', STRAIGHT, [1, 0, 0])
    assert tree.pose('a', 'c') is None


def test_rotations_of_any_length_are_taken_and_others_refused():
    tree = FrameTree()
    tree.take('a', 'b', [0, 0, 3, 3], [0, 0, 0])
    assert at(tree, 'b', 'a', (1, 0, 0)) == pytest.approx([0, 1, 0])
    for rotation, translation in (([0, 0, 0, 0], [0, 0, 0]), ([0, 0, 0, np.nan], [0, 0, 0]), ([0, 0, 0, 1], [0, np.inf, 0]),
                                  ([0, 0, 1e200, 1e200], [0, 0, 0]), ([1e308] * 4, [0, 0, 0]), ([0, 0, np.inf, 0], [0, 0, 0]),
                                  ([0, 0, 0, 1], [1e300, 0, 0]), ([0, 0, 0, 1], [np.nan, 0, 0])):
        with pytest.raises(BadFrame):
            tree.take('a', 'c', rotation, translation)
    with pytest.raises(BadFrame):
        tree.take('a', 'a', [0, 0, 0, 1], [0, 0, 0])


RAYS = np.array([[0, 0, 1.0], [0, 1.0, 0]])


@pytest.mark.parametrize('origin', [np.zeros(3), np.zeros((2, 3))])
def test_near_and_far_side_of_a_sphere(origin):
    near, far = sphere_ranges(origin, RAYS, np.array([0, 0, 0.05]), 0.008)
    assert [near[0], far[0]] == pytest.approx([0.042, 0.058]) and np.isnan([near[1], far[1]]).all()


def test_rays_from_inside_meet_the_cap():
    cap = Cap(0.020, 0.013)
    assert cap.meet(np.array([0, 0, -0.01]), RAYS[:1]) == pytest.approx(np.array([[0, 0, 0.013]]))
    assert cap.heights(np.array([[0, 0], [cap.rim_radius, 0], [1.0, 0]])) == pytest.approx([0.013, 0, np.nan], nan_ok=True, abs=1e-12)


def test_a_cap_higher_than_its_sphere_is_refused():
    with pytest.raises(BadArgument, match='height'):
        Cap(0.020, 0.041)


@pytest.mark.parametrize('levels', [4, 14])
def test_values_of_a_cubic_are_met_at_and_between_levels(levels):
    cubic = np.poly1d([0.3, -1.0, 2.0, 5.0])
    coefficients = spline_fit(levels) @ cubic(np.arange(levels + 1))
    at = np.linspace(0, levels, 50)
    assert np.allclose(BSpline(np.arange(-3, levels + 4), coefficients, 3)(at), cubic(at))


@pytest.mark.parametrize('corners, depth', [
    ([[0, 0], [4, 0], [4, 3], [2, 1.2], [0, 3]], 1.8), ([[0, 0], [2, 1], [4, 0], [4, 3], [0, 3]], 1.0),
    ([[0, 0], [2, 0], [2, 2], [0, 2]], 0.0), ([[0, 0], [2, 0], [0, 2]], 0.0), ([[1, 1]] * 7, 0.0), ([[0, 0], [1, 1], [2, 2], [1, 1]], 0.0)])
@pytest.mark.parametrize('direction', [1, -1])
def test_a_notch_is_as_deep_as_it_lies_below_the_hull(corners, depth, direction):
    assert deepest_notch(np.array(corners, float)[::direction]) == pytest.approx(depth, abs=2e-3)


@pytest.mark.parametrize('width', [0.0, 0.9e-3, 1.1e-3, 0.5])
def test_points_are_on_a_line_by_their_second_extent(width):
    rng = np.random.default_rng(5)
    cloud = rng.normal(size=(50, 3))
    extents = np.linalg.qr(cloud - cloud.mean(axis=0))[0] * [1.0, width, 0.0]
    points = extents @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.normal(size=3)
    assert are_collinear(points, min_aspect=1e-3) == (width < 1e-3)


@pytest.mark.parametrize('ids', [[0, 6], [-1, 2], [1, 1]])
def test_refuses_ids_off_the_grid(ids):
    with pytest.raises(BadArgument):
        to_grid(np.array(ids), np.zeros(2), 2, 3)


def test_slopes_are_central_and_one_sided_at_gaps():
    column, row = np.meshgrid(np.arange(5.0), np.arange(2.0))
    normal = grid_normals(np.stack([column, row, np.tile([0.0, 1, 4, np.nan, 16], (2, 1))], axis=-1))
    np.testing.assert_allclose(-normal[..., 0] / normal[..., 2], np.tile([1, 2, 3, np.nan, np.nan], (2, 1)), rtol=1e-12)
    assert np.isnan(grid_normals(np.stack([column, row, column], axis=-1)[:1])).all()  # the slope along rows is undetermined


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
    positions = on_a_sphere(300)
    off = degrees_off(scattered_normals(positions), positions / RADIUS)
    assert np.median(off) < 1.5 and np.percentile(off, 95) < 5.0


def test_normals_of_scattered_points_of_a_plane_are_exact_and_upward():
    rng = np.random.default_rng(1)
    xy = rng.uniform(-0.1, 0.1, (60, 2))
    true = np.array([0.3, -0.2, 1.0]) / np.linalg.norm([0.3, -0.2, 1.0])
    positions = np.column_stack([xy, -(xy @ true[:2]) / true[2]])
    assert degrees_off(scattered_normals(positions), np.tile(true, (60, 1))).max() < 1e-4


@pytest.mark.parametrize('count', [0, 1, 3])
def test_too_few_points_have_no_normal(count):
    assert np.isnan(scattered_normals(np.random.default_rng(0).normal(size=(count, 3)))).all()


def test_a_point_without_a_place_has_no_normal_and_spoils_no_other():
    positions = on_a_sphere(300)
    positions[[5, 90]] = np.nan
    found = scattered_normals(positions)
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


MATRIX = np.array([[600.0, 0, 320], [0, 605, 240], [0, 0, 1]])
LENSES = [np.zeros(5), np.array([-0.1, 0.02, 1e-4, -2e-4, 0.0]), np.array([0.08, 0.0, -3e-4, 2e-4, 0.01]),
          np.array([-0.3, 0.12, 0, 0, -0.02])]
ROTATION = cv2.Rodrigues(np.array([0.1, -0.2, 0.3]))[0]
CENTRE, PLANE_Z = np.array([0.003, -0.002, -0.06]), 0.004


def camera(lens, rotation=ROTATION):
    return Camera(matrix=MATRIX, distortion=lens, rotation=rotation, farthest=farthest_square(lens))


def seen(uv, lens, rotation=ROTATION):
    return MarkerView(camera=camera(lens, rotation), centre=CENTRE, plane_z=PLANE_Z, camera_centres=np.zeros((2, 3))).back_project(uv)


def image(positions, lens, rotation=ROTATION):
    """(N, 2) px: OpenCV's projection of positions (N, 2) in the plane."""
    points = np.column_stack([positions, np.full(len(positions), PLANE_Z)])
    return cv2.projectPoints(points, cv2.Rodrigues(rotation)[0], -rotation @ CENTRE, MATRIX, lens)[0].reshape(-1, 2)


@pytest.mark.parametrize('lens', LENSES)
def test_places_are_found_from_their_pixels(lens):
    positions = np.random.default_rng(1).uniform(-0.025, 0.025, (200, 2))
    assert seen(image(positions, lens), lens)[:, :2] == pytest.approx(positions, abs=1e-12)


@pytest.mark.parametrize('lens', LENSES)
def test_the_area_of_a_pixel_is_that_between_its_neighbours(lens):
    uv = np.random.default_rng(2).uniform([0, 0], [640, 480], (50, 2))
    right, down = (seen(uv + step, lens)[:, :2] - seen(uv - step, lens)[:, :2] for step in ([0.5, 0], [0, 0.5]))
    assert seen(uv, lens)[:, 2] == pytest.approx(np.abs(right[:, 0] * down[:, 1] - right[:, 1] * down[:, 0]), rel=1e-4)


@pytest.mark.parametrize('lens', LENSES)
def test_rays_go_through_what_their_pixels_show(lens):
    points = np.random.default_rng(3).uniform([-0.025, -0.025, -0.01], [0.025, 0.025, 0.01], (200, 3))
    uv = cv2.projectPoints(points, cv2.Rodrigues(ROTATION)[0], -ROTATION @ CENTRE, MATRIX, lens)[0].reshape(-1, 2)
    away = points - CENTRE
    rays = camera(lens).rays(uv)
    assert rays == pytest.approx(away / np.linalg.norm(away, axis=1, keepdims=True), abs=1e-11)


def test_what_the_lens_does_not_image_and_what_is_not_a_place_are_unknown():
    fold = LENSES[3] * [1, 0, 0, 0, 0]
    outside = np.array([[320 + 601 * np.sqrt(farthest_square(fold)), 240], [np.nan, 3.0], [np.inf, 3.0], [1e30, 1e30]])
    assert np.isnan(seen(outside, fold)).all()
    assert np.isnan(camera(fold).rays(outside)).all()
    assert np.isnan(seen(outside[1:], LENSES[0], np.eye(3))).all()
    horizon = cv2.Rodrigues(np.array([np.pi / 2, 0.0, 0.0]))[0]  # the plane is seen edge on
    assert np.isnan(seen(np.array([[320.0, 240.0]]), LENSES[0], horizon)).all()
