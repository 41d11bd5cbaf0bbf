# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.dots import DotTracks
from tactile_perception.touchpad.optics.absorption import RestLight
from tactile_perception.touchpad.optics.surface_shape import SurfaceShape

SIDE, PITCH, HEIGHT = 9, 1e-3, np.float32(0.05)
CENTRE = np.zeros((3, 1), np.float32)


@pytest.fixture
def flat():
    """Rays and ranges of a grid in the plane z = HEIGHT, seen from the origin, and the same as known at rest."""
    y, x = np.meshgrid(*[PITCH * (np.arange(SIDE) - SIDE // 2)] * 2, indexing='ij')
    places = np.float32(np.stack([x.ravel(), y.ravel(), np.full(SIDE**2, HEIGHT)]))
    ranges = np.sqrt((places**2).sum(0))
    normals = np.zeros_like(places)
    normals[2] = 1
    return places / ranges, ranges, RestLight(ranges, normals, ranges, ranges)


def _tracks(id, side=SIDE):
    none = np.zeros((len(id), 2))
    return DotTracks(side, side, id, none, none[:, 0], none[:, 0], none)


def test_a_tilt_turns_the_normals_and_bends_nothing(flat):
    rays, ranges, rest = flat
    tilted = HEIGHT / (rays[2] - np.float32(0.1) * rays[0])  # z = HEIGHT + 0.1 x
    facing, curvature = SurfaceShape().at(tilted, rays, CENTRE, rest, _tracks(np.arange(SIDE**2)))
    inner = np.zeros((SIDE, SIDE), bool)
    inner[2:-2, 2:-2] = True
    expected = np.array([-0.1, 0, 1]) / np.hypot(0.1, 1)
    np.testing.assert_allclose(facing[:, inner.ravel()], np.repeat(expected[:, None], inner.sum(), 1), atol=3e-3)
    assert np.abs(curvature[inner.ravel()]).max() < 3e-6


def test_a_shape_serves_three_frames_or_until_dots_have_gone_far(flat):
    rays, ranges, rest = flat
    shape, tracks = SurfaceShape(), _tracks(np.arange(SIDE**2))
    first = shape.at(ranges, rays, CENTRE, rest, tracks)
    assert shape.at(ranges + np.float32(1e-4), rays, CENTRE, rest, tracks) is first
    assert shape.at(ranges, rays, CENTRE, rest, tracks) is first
    second = shape.at(ranges, rays, CENTRE, rest, tracks)
    assert second is not first
    third = shape.at(ranges - np.float32(5e-4), rays, CENTRE, rest, tracks)
    assert third is not second
    fewer = shape.at(ranges[1:], rays[:, 1:], CENTRE, rest.take(tracks.id[1:]), _tracks(tracks.id[1:]))
    assert fewer[0].shape == (3, SIDE**2 - 1)


def test_without_a_grid_the_normals_are_those_at_rest(flat):
    rays, ranges, rest = flat
    facing, curvature = SurfaceShape().at(ranges, rays, CENTRE, rest, _tracks(np.arange(SIDE**2), 0))
    assert facing is rest.normals and not curvature.any()
