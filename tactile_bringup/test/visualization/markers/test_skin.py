# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_bringup.visualization.markers import SkinMarkers


def grid(side):
    row, column = np.divmod(np.arange(side * side), side)
    return np.arange(side * side), np.column_stack([column, row, np.zeros(side * side)]) * 1e-3


@pytest.mark.parametrize(('side', 'columns', 'corners'), [(3, 3, 24), (23, 23, 1452), (23, 0, 2904)])
def test_a_corner_has_a_colour_and_of_many_dots_every_other_is_used(side, columns, corners):
    id, places = grid(side)
    skin = SkinMarkers()
    found = skin.corners(id, places, columns)
    assert len(found) == len(skin.colours(places, np.zeros(len(id)))) == pytest.approx(corners, rel=0.01)
    triangles = places[found].reshape(-1, 3, 3)
    area = 0.5 * np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1).sum()
    assert area == pytest.approx((side - 1)**2 * 1e-6, rel=0.01)


def test_the_triangles_are_kept_while_the_same_dots_are_seen():
    id, places = grid(4)
    skin = SkinMarkers()
    first = skin.corners(id, places, 4)
    assert skin.corners(id, places[::-1], 4) == first and skin.corners(id[:8], places[:8], 4) != first


def test_depth_and_slope_show_in_the_colour():
    id, places = grid(4)
    skin = SkinMarkers()
    skin.corners(id, places, 4)
    share = np.zeros(16)
    flat = skin.colours(places, share)
    share[5], places[5, 2] = 1.0, -1e-3
    dented = skin.colours(places, share)
    assert len({(c.r, c.g, c.b, c.a) for c in flat}) == 1 and len({(c.r, c.g, c.b, c.a) for c in dented}) > 3
    assert all(0 < c.a < 1 for c in flat)
