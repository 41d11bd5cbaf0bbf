# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Rotations, poses of frames, vectors, caps and splines."""
import numpy as np
import pytest
from scipy.interpolate import BSpline
from tactile_perception.common.geometry import (Cap, FrameTree, deepest_notch, lie_on_a_line, matrix_of_quaternion, quaternion,
                                                rotation_matrix, sphere_ranges, spline_fit, tangents)
from tactile_perception.errors import BadArgument, BadFrame


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


def at(tree, frame, reference, place=(0, 0, 0)):
    rotation, translation = tree.pose(frame, reference)
    return rotation @ place + translation


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
@pytest.mark.parametrize('way', [1, -1])
def test_a_notch_is_as_deep_as_it_lies_below_the_hull(corners, depth, way):
    assert deepest_notch(np.array(corners, float)[::way]) == pytest.approx(depth, abs=2e-3)


@pytest.mark.parametrize('width', [0.0, 0.9e-3, 1.1e-3, 0.5])
def test_points_are_on_a_line_by_their_second_extent(width):
    rng = np.random.default_rng(5)
    cloud = rng.normal(size=(50, 3))
    extents = np.linalg.qr(cloud - cloud.mean(axis=0))[0] * [1.0, width, 0.0]
    points = extents @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.normal(size=3)
    assert lie_on_a_line(points, thinnest=1e-3) == (width < 1e-3)
