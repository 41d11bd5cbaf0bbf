# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Annotated images."""

import numpy as np
import pytest
from geometry_msgs.msg import Point, Point32, Polygon, Vector3, WrenchStamped
from sensor_msgs.msg import CameraInfo
from tactile_bringup.visualization import pictures as colours
from tactile_bringup.visualization.pictures import ARRAY_LEGEND, Annotation, annotate, annotation_of, projection
from tactile_driver.stitching.calibration import SideView, Stitching
from tactile_msgs.msg import Contact, ContactRegion, Contacts, DotTracks, Slip
from tactile_perception.nodes.messages.conversions import camera_matrices

GREY = np.full((480, 640), 100, np.uint8)


def changed(image, ground=100):
    """(H, W) whether a pixel differs from the even ground."""
    return (image != ground).any(axis=2)


def dots_at(*places, moved=(0.0, 0.0), state=0):
    uv = np.array(places, float)
    n = len(uv)
    return Annotation(0, 0, np.arange(n), uv, np.tile(moved, (n, 1)).astype(float), np.full(n, state), radius=3.0)


def centroid(mask):
    v, u = np.nonzero(mask)
    return u.mean(), v.mean()


@pytest.mark.parametrize('state', [0, 1, 2])
def test_a_ring_in_the_colour_of_its_state_lies_round_its_dot(state):
    result = annotate(GREY, dots_at((200.25, 100.75), state=state))
    u, v = centroid(changed(result))
    assert abs(u - 200.25) < 0.2 and abs(v - 100.75) < 0.2
    assert (result == colours.bgr(colours.STATE_COLOURS[state])).all(axis=2).any()
    assert not changed(result)[101, 200]


def test_an_arrow_goes_from_rest_to_where_the_dot_is():
    result = annotate(GREY, dots_at((200, 100), moved=(40, 0)))
    v, u = np.nonzero((result[..., 2] > 180) & (result[..., 0] < 130))  # yellow, softened at its edges
    assert abs(u.min() - 160) <= 1 and abs(u.max() - 200) <= 1
    assert 4 <= v.max() - v.min() <= 8
    # The head is at the end.
    assert (np.ptp(v[u > 194]) if (u > 194).any() else 0) > np.ptp(v[u < 190])


def test_small_images_are_enlarged_with_pixel_centres_kept():
    result = annotate(np.full((240, 320), 100, np.uint8), dots_at((100, 60)))
    assert result.shape == (480, 640, 3)
    u, v = centroid(changed(result))
    assert abs(u - 200.5) < 0.2 and abs(v - 120.5) < 0.2


def test_a_region_is_veiled_and_its_hole_is_not():
    square = np.array([(100, 100), (200, 100), (200, 200), (100, 200)], float)
    hole = np.array([(140, 140), (140, 160), (160, 160), (160, 140)], float)
    result = annotate(GREY, Annotation(outlines=[square], holes=[hole]))
    assert changed(result)[120, 120] and not changed(result)[150, 150] and not changed(result)[90, 90]
    assert (result[100, 150] == colours.bgr(colours.REGION)).all()
    assert (result[150, 140] == colours.bgr(colours.HOLE)).all()
    expected = 0.78 * 100 + 0.22 * np.array(colours.bgr(colours.REGION))
    assert np.abs(result[120, 120] - expected).max() <= 1.5


K = [500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0]
DOTS = DotTracks(rows=23, columns=23, id=[4, 7], u=[10.0, 20.0], v=[1.0, 2.0], du=[3.0, float('nan')], dv=[4.0, float('nan')],
                 area=[12.566, 12.566])
REGION = ContactRegion(dot_id=[7], dot_state=[2], outlines=[Polygon(points=[Point32(x=0.01), Point32(y=0.01), Point32(x=-0.01)])],
                       area=5e-5)


CAMERA = projection(camera_matrices(CameraInfo(k=K, distortion_model='plumb_bob', d=[0.0] * 5)), [0.0] * 3, [0.0, 0.0, 0.05])


def test_places_are_projected_by_hand():
    assert CAMERA(np.array([(0.01, -0.005, 0.0)]))[0] == pytest.approx([320 + 500 * 0.01 / 0.05, 240 - 500 * 0.005 / 0.05])
    assert projection(camera_matrices(CameraInfo()), [0.0] * 3, [0.0] * 3) is None, 'not calibrated'


def camera_at(x):
    return SideView((640, 480), np.eye(3), np.zeros(5), np.eye(3), np.array([x, 0.0, -0.05]))


def test_places_in_a_stitched_picture_by_hand():
    """Two cameras 5 cm under the sheet and 4 cm apart, 10 px/mm: what lies 1 cm under it is seen a quarter further from the camera centre;
    what lies across the seam is drawn in one piece."""
    stitching = Stitching(camera_at(-0.02), camera_at(0.02), (1200, 900), 1e4, np.array([600.0, 450.0]), 600.0, (500.0, 100.0))
    place = projection(None, [0.0] * 3, [0.0] * 3, stitching)
    for x, u in ((-0.03, 600 - 325), (0.03, 600 + 325)):
        assert place(np.array([(x, 0.02, -0.01)]))[0] == pytest.approx((u, 450 + 250))
    across = place(np.array([(-0.02, -0.01, 0.0), (-0.01, 0.0, -0.01), (0.01, 0.0, -0.01)]))
    assert across == pytest.approx(np.array([(400, 350), (600 - 75, 450), (600 + 175, 450)]))


def test_all_that_is_known_comes_into_the_picture():
    contacts = Contacts(contacts=[Contact(position=Point(z=0.05), depth=2e-3), Contact(position=Point(x=float('nan')))])
    what = annotation_of({'dots': DOTS, 'contact_region': REGION, 'contacts': contacts}, CAMERA)
    assert what.uv.tolist() == [[10, 1], [20, 2]] and what.state.tolist() == [-1, 2]
    assert what.radius == pytest.approx(2.0, abs=1e-3)
    assert what.outlines[0] == pytest.approx(np.array([(420, 240), (320, 340), (220, 240)]))
    assert what.contacts.tolist() == [[320, 240]]
    assert what.text == ['2 dots, largest displacement 5.0 px', '50 mm2, 2.0 mm deep, 0.00 N, 0 stick, 1 slip']


def messages():
    """A square of 10 mm about (5, 2) mm that slips at 4 mm/s along x."""
    corners = [Point32(x=x, y=y) for x, y in ((0.0, -3e-3), (0.01, -3e-3), (0.01, 7e-3), (0.0, 7e-3))]
    region = ContactRegion(outlines=[Polygon(points=corners)], area=1e-4, centroid=Point(x=5e-3, y=2e-3))
    slip = Slip(state=Slip.GROSS)
    slip.velocity.linear, slip.velocity.angular = Vector3(x=4e-3), Vector3(z=float('nan'))
    wrench = WrenchStamped()
    wrench.wrench.force.z = -3.0
    contacts = Contacts(contacts=[Contact(position=Point(x=5e-3, y=2e-3))])
    return {'contact_region': region, 'contacts': contacts, 'slip': slip, 'wrench': wrench}


def test_everything_lies_where_it_is():
    what = annotation_of(messages(), lambda xyz: 1e3 * xyz[:, :2] + 21.5, ARRAY_LEGEND, 0.5)
    assert what.outlines[0][0] == pytest.approx([21.5, 18.5]) and what.contacts[0] == pytest.approx([26.5, 23.5])
    assert what.duv[0] == pytest.approx([2.0, 0.0]) and what.uv[0] == pytest.approx([28.5, 23.5])
    assert what.text == ['100 mm2, 0.0 mm deep, 3.0 N, gross slip']
