# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np

from tactile_perception.dots.detect.background import GroundSlopes


def test_a_plane_is_found_at_its_edge_too_and_bad_dots_do_not_count():
    u, v = (a.ravel() for a in np.meshgrid(np.arange(10.0, 200, 18), np.arange(10.0, 150, 18)))
    ground = 150 + 0.3 * u - 0.2 * v
    good = np.ones(len(u), bool)
    good[7] = False
    ground[7] = 255.0
    along_u, along_v = GroundSlopes(u, v, ground, good, 18.0).at(u, v)
    # a share of the mean ground of the neighbours, which differs a little from the ground at the dot
    np.testing.assert_allclose(along_u[good], 0.3 / ground[good], rtol=0.06)
    np.testing.assert_allclose(along_v[good], -0.2 / ground[good], rtol=0.06)


def test_too_few_neighbours_give_no_slope():
    u, v = np.array([10.0, 30.0]), np.array([10.0, 10.0])
    along_u, along_v = GroundSlopes(u, v, np.array([100.0, 120.0]), np.ones(2, bool), 18.0).at(u, v)
    assert not along_u.any() and not along_v.any()


def test_slopes_hold_while_the_light_stays():
    u, v = (a.ravel() for a in np.meshgrid(np.arange(10.0, 200, 18), np.arange(10.0, 150, 18)))
    slopes = GroundSlopes(u, v, np.full(len(u), 150.0), np.ones(len(u), bool), 18.0)
    assert slopes.hold_for(np.full(len(u), 150.2))
    assert not slopes.hold_for(np.full(len(u), 152.0))
    assert not slopes.hold_for(np.full(len(u) - 1, 150.0))
