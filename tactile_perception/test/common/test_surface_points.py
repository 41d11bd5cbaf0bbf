# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Normals, displacements and normal forces against surfaces of which all is known."""
import numpy as np
import pytest
from tactile_perception.common.surface_points import STICKING, SurfacePoints, dot_points, scattered_normals
from tactile_perception.errors import BadArgument

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
