# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.dot_surface import DotSurface
from tactile_perception.errors import BadArgument


def test_points_lie_on_the_cap(pad):
    surface = DotSurface(pad.rest.reshape(23, 23, 3))
    places = np.random.default_rng(0).uniform(4, 18, (200, 2))
    points = surface.points(places)
    np.testing.assert_allclose(points[:, 0], (places[:, 1] - 11) * pad.pitch, atol=1e-12)
    assert np.abs(points[:, 2] - pad.cap.heights(points[:, :2])).max() < 1e-6


def test_reaches_half_a_pitch_beyond(pad):
    point = DotSurface(pad.rest.reshape(23, 23, 3)).points(np.array([[11.0, 22.5]]))[0]
    np.testing.assert_allclose(point[:2], [11.5 * pad.pitch, 0], atol=1e-9)


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
