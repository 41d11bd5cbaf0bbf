# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from geometry_msgs.msg import Point, Point32, Polygon
from sensor_msgs.msg import CameraInfo
from tactile_bringup.visualization.annotation import Projection, annotation_of
from tactile_driver.stitching.calibration import SideView, Stitching
from tactile_msgs.msg import Contact, ContactRegion, Contacts, DotTracks
from tactile_perception.nodes.messages.conversions import camera_matrices

K = [500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0]
DOTS = DotTracks(rows=23, columns=23, id=[4, 7], u=[10.0, 20.0], v=[1.0, 2.0], du=[3.0, float('nan')], dv=[4.0, float('nan')],
                 area=[12.566, 12.566])
REGION = ContactRegion(dot_id=[7], dot_state=[2], outlines=[Polygon(points=[Point32(x=0.01), Point32(y=0.01), Point32(x=-0.01)])],
                       area=5e-5)


def projection(k=None):
    info = CameraInfo(k=K if k is None else k, distortion_model='plumb_bob', d=[0.0] * 5)
    return Projection(info, camera_matrices(info), [0.0, 0.0, 0.0], [0.0, 0.0, 0.05])


def test_places_are_projected_by_hand():
    uv = projection().places(np.array([(0.01, -0.005, 0.0), (np.nan, 0, 0)]))
    assert uv[0] == pytest.approx([320 + 500 * 0.01 / 0.05, 240 - 500 * 0.005 / 0.05])
    assert np.isnan(uv[1]).all()


def test_without_a_calibration_nothing_is_projected():
    assert np.isnan(projection([0.0] * 9).places(np.zeros((2, 3)))).all()
    assert annotation_of({'dots': DOTS, 'contact_region': REGION}, projection([0.0] * 9)).outlines == []


def camera_at(x):
    return SideView((640, 480), np.eye(3), np.zeros(5), np.eye(3), np.array([x, 0.0, -0.05]))


def test_places_in_a_stitched_picture_by_hand():
    """Two cameras 5 cm under the sheet and 4 cm apart, 10 px/mm: what lies 1 cm under it is seen a quarter further from the eye; what
    lies across the seam is drawn in one piece."""
    stitching = Stitching(camera_at(-0.02), camera_at(0.02), (1200, 900), 1e4, np.array([600.0, 450.0]), 600.0, (500.0, 100.0))
    info = CameraInfo(width=1200, height=900)
    drawn = Projection(info, camera_matrices(info), [0.0] * 3, [0.0] * 3, stitching)
    for x, u in ((-0.03, 600 - 325), (0.03, 600 + 325)):
        uv = drawn.places(np.array([(x, 0.02, -0.01), (np.nan, 0, 0)]))
        assert uv[0] == pytest.approx((u, 450 + 250)) and np.isnan(uv[1]).all()
    across = drawn.places(np.array([(-0.02, -0.01, 0.0), (-0.01, 0.0, -0.01), (0.01, 0.0, -0.01)]))
    assert across == pytest.approx(np.array([(400, 350), (600 - 75, 450), (600 + 175, 450)]))


def test_all_that_is_known_comes_into_the_picture():
    contacts = Contacts(contacts=[Contact(position=Point(z=0.05), depth=2e-3)])
    what = annotation_of({'dots': DOTS, 'contact_region': REGION, 'contacts': contacts}, projection())
    assert what.uv.tolist() == [[10, 1], [20, 2]] and what.state.tolist() == [-1, 2]
    assert what.radius == pytest.approx(2.0, abs=1e-3)
    assert what.outlines[0] == pytest.approx(np.array([(420, 240), (320, 340), (220, 240)]))
    assert what.contacts.tolist() == [[320, 240]]
    assert what.text == ['2 dots, largest displacement 5.0 px', '50 mm2, 2.0 mm deep, 0.00 N, 0 stick, 1 slip']
