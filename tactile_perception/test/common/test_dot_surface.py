# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.dot_surface import DotSurface, along_lines, cubic_weights
from tactile_perception.errors import BadArgument


def test_weights_carry_a_parabola():
    t = np.linspace(0, 1, 11)
    nodes = np.arange(-1, 3)[:, None]
    np.testing.assert_allclose((cubic_weights(t) * (3 - nodes + 2 * nodes**2)).sum(axis=0), 3 - t + 2 * t**2)


def test_points_lie_on_the_cap(pad):
    surface = DotSurface(pad.rest.reshape(23, 23, 3))
    places = np.random.default_rng(0).uniform(4, 18, (200, 2))
    points = surface.points(places)
    np.testing.assert_allclose(points[:, 0], (places[:, 1] - 11) * pad.pitch, atol=1e-12)
    assert np.abs(points[:, 2] - pad.cap.heights(points[:, :2])).max() < 1e-6


def test_reaches_half_a_pitch_beyond(pad):
    point = DotSurface(pad.rest.reshape(23, 23, 3)).points(np.array([[11.0, 22.5]]))[0]
    np.testing.assert_allclose(point[:2], [11.5 * pad.pitch, 0], atol=1e-9)


def test_refined_surface_is_read_off_along_its_lines(pad):
    surface = DotSurface(pad.rest.reshape(23, 23, 3))
    fine = surface.fine(3, 5, (8, 9), 2)
    assert fine.shape == (15, 17, 3)
    places = np.array([[2.0, 3.0], [4.0, 6.3], [7.6, 5.0], [14.0, 16.0]])
    points = surface.points(places / 2 + [3, 5])
    np.testing.assert_allclose(along_lines(fine, places[:3]), points[:3], atol=5e-6)
    np.testing.assert_allclose(fine[14, 16], pad.rest.reshape(23, 23, 3)[10, 13])


def test_place_and_normal_are_the_caps(pad):
    xy = np.array([3.2e-3, -2.1e-3])
    place, normal = DotSurface(pad.rest.reshape(23, 23, 3)).place_and_normal(xy)
    np.testing.assert_allclose(place[:2], xy, atol=1e-9)
    assert place[2] == pytest.approx(pad.cap.heights(xy[None])[0], abs=1e-6)
    np.testing.assert_allclose(normal, (place - [0, 0, pad.cap.centre_z]) / pad.cap.curvature_radius, atol=2e-3)


def test_unseen_dots_are_continued(pad):
    grid = pad.rest.reshape(23, 23, 3).copy()
    true = grid[10, 12].copy()
    grid[10, 12] = np.nan
    assert np.linalg.norm(DotSurface(grid).xyz[10, 12] - true) < 40e-6


def test_refuses_what_is_no_surface():
    with pytest.raises(BadArgument):
        DotSurface(np.zeros((23, 3)))
    with pytest.raises(BadArgument):
        DotSurface(np.full((23, 23, 3), np.nan))
