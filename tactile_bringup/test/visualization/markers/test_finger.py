# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import Header
from tactile_bringup.nodes.finger_markers_node import FingerMarkers, finger_picture, hemisphere
from tactile_msgs.msg import Contact, Contacts
from visualization_msgs.msg import Marker

SIZES = {'radius': 0.016, 'point_size': 1.5e-3, 'normal_length': 8e-3, 'trail': 1.0}


def told(stamp, *contacts):
    message = Contacts(header=Header(frame_id='finger'), contacts=[
        Contact(id=number, position=Point(x=0.016 * np.sin(a), z=0.016 * np.cos(a)), normal=Vector3(x=np.sin(a), z=np.cos(a)),
                position_covariance=(1e-8 * np.eye(3)).ravel()) for number, a in contacts])
    message.header.stamp.sec, message.header.stamp.nanosec = int(stamp), round(stamp % 1 * 1e9)
    return message


def drawn(markers, message):
    markers.note(message)
    return {(m.ns, m.id): m for m in markers.frame(message.header, {'contacts': message}).markers if m.action == Marker.ADD}


def test_the_hemisphere_is_closed_and_round():
    corners, light = hemisphere(0.016)
    assert np.linalg.norm(corners, axis=1) == pytest.approx(0.016) and corners[:, 2].min() == pytest.approx(0, abs=1e-9)
    area = 0.5 * np.linalg.norm(np.cross(corners[1::3] - corners[::3], corners[2::3] - corners[::3]), axis=1).sum()
    assert area == pytest.approx(2 * np.pi * 0.016**2, rel=0.02)
    assert light.shape == (len(corners),) and 0.3 < light.min() < light.max() <= 1
    assert np.ptp(light[corners[:, 2] > 0.0159]) < 0.1, 'one brightness at the pole, whichever triangle a corner belongs to'


def test_a_touch_its_normal_its_uncertainty_and_its_way():
    markers = FingerMarkers(SIZES)
    for k in range(10):
        found = drawn(markers, told(5 + 0.05 * k, (3, 0.1 * k)))
    assert set(found) == {('finger', 0), ('points', 0), ('normals', 3), ('covariances', 3), ('trail', 3), ('text', 0)}
    assert len(found['trail', 3].points) == 10 and found['points', 0].points[0].x == pytest.approx(0.016 * np.sin(0.9))
    assert len(found['finger', 0].colors) == len(found['finger', 0].points), 'else RViz lights it from the eye'
    ends = found['normals', 3].points
    assert ends[1].z - ends[0].z == pytest.approx(8e-3 * np.cos(0.9))
    assert {m.header.frame_id for m in found.values()} == {'finger'}


def test_the_trail_fades_and_begins_anew_with_the_stamps():
    markers = FingerMarkers(SIZES)
    for k in range(60):
        found = drawn(markers, told(5 + 0.05 * k, (3, 0.01 * k)))
    assert 19 <= len(found['trail', 3].points) <= 22
    assert set(drawn(markers, told(20.0))) == {('finger', 0), ('text', 0)}
    drawn(markers, told(2.0, (4, 0.1)))
    assert ('trail', 4) in drawn(markers, told(2.1, (4, 0.2)))


def test_a_place_that_is_not_known_is_not_drawn():
    message = told(5.0, (1, 0.1))
    message.contacts[0].position = Point(x=float('nan'), y=float('nan'), z=float('nan'))
    assert set(drawn(FingerMarkers(SIZES), message)) == {('finger', 0), ('text', 0)}


def test_the_picture_shows_where_the_finger_is_touched():
    message = told(5.0, (1, np.pi / 6))
    message.contacts.append(Contact(normal=Vector3(x=float('nan'), y=float('nan'), z=float('nan'))))
    made, empty = finger_picture(message), finger_picture(Contacts())
    assert made.shape == empty.shape
    rows, columns = np.nonzero((made != empty).any(axis=2)[:made.shape[1]])
    assert (columns.mean() / made.shape[1], rows.mean() / made.shape[1]) == pytest.approx((0.5 + 0.5 * 160 / 360, 0.5), abs=0.01)
