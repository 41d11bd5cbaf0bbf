# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')

from geometry_msgs.msg import Point, Vector3  # noqa: E402
from std_msgs.msg import ColorRGBA  # noqa: E402
from visualization_msgs.msg import Marker  # noqa: E402

from tactile_bringup.visualization.markers.picture import marker_picture  # noqa: E402

RED, GREEN, WHITE = ColorRGBA(r=1.0, a=1.0), ColorRGBA(g=1.0, a=1.0), ColorRGBA(r=1.0, g=1.0, b=1.0, a=1.0)
CORNERS = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, -1, 0), (1, 1, 0), (-1, 1, 0)]
SIZE = 300, 240


def marker(kind, places, colour, ns='', **more):
    return Marker(type=kind, ns=ns, color=colour, points=[Point(x=float(x), y=float(y), z=float(z)) for x, y, z in places],
                  scale=Vector3(x=0.2, y=0.2, z=0.2), **more)


def share(picture, bgr):
    return (np.abs(picture.astype(int) - bgr).max(axis=2) < 3).mean()


def test_a_surface_fills_much_of_the_picture_and_what_is_on_it_is_over_it():
    skin = marker(Marker.TRIANGLE_LIST, CORNERS, WHITE, ns='skin', colors=[RED, RED])
    dots = marker(Marker.SPHERE_LIST, [(0, 0, 0)], GREEN, ns='dots')
    picture = marker_picture([dots, skin], SIZE)
    assert picture.shape == (240, 300, 3) and share(picture, (0, 0, 255)) > 0.25
    rows, columns = np.nonzero((picture == (0, 255, 0)).all(axis=2))
    assert len(rows) > 50 and (columns.mean(), rows.mean()) == pytest.approx((150, 120), abs=40)


def test_the_nearer_triangle_hides_the_further_one():
    low = [(x, y, z - 0.5) for x, y, z in CORNERS]
    both = marker(Marker.TRIANGLE_LIST, CORNERS + low, WHITE, colors=[GREEN, GREEN, RED, RED])
    assert share(marker_picture([both], SIZE), (0, 255, 0)) > 2 * share(marker_picture([both], SIZE), (0, 0, 255))


def test_a_half_transparent_surface_lets_the_ground_through():
    veil = ColorRGBA(r=1.0, a=0.5)
    picture = marker_picture([marker(Marker.TRIANGLE_LIST, CORNERS, WHITE, colors=[veil] * 6)], SIZE)
    assert share(picture, (19, 16, 144)) > 0.25


@pytest.mark.parametrize(('kind', 'places'), [(Marker.LINE_LIST, CORNERS), (Marker.LINE_STRIP, CORNERS), (Marker.ARROW, CORNERS[:2])])
def test_lines_and_arrows_are_drawn(kind, places):
    assert share(marker_picture([marker(kind, places, GREEN)], SIZE), (0, 255, 0)) > 0.001


def test_nothing_to_draw_is_no_picture():
    gone = Marker(action=Marker.DELETEALL)
    assert marker_picture([gone, marker(Marker.SPHERE_LIST, [], RED)], SIZE) is None


def test_text_is_written_where_it_stands():
    text = Marker(type=Marker.TEXT_VIEW_FACING, text='0.7 N', color=GREEN, scale=Vector3(x=0.1, z=0.2))
    picture = marker_picture([marker(Marker.TRIANGLE_LIST, CORNERS, WHITE, colors=[RED, RED]), text], SIZE)
    rows, columns = np.nonzero((picture.astype(int) - (0, 128, 0) >= 0).all(axis=2) & (picture[..., 2] < 128))
    assert len(rows) > 20 and (columns.mean(), rows.mean()) == pytest.approx((150, 120), abs=40)
