# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""RViz markers."""

import numpy as np
import pytest
from geometry_msgs.msg import Point, Point32, Polygon, Vector3, WrenchStamped
from scipy.spatial.transform import Rotation
from std_msgs.msg import Header
from tactile_bringup.visualization import pictures as colours
from tactile_bringup.visualization.markers import DotMarkers, FingerMarkers, TaxelMarkers
from tactile_bringup.visualization.pictures import finger_picture
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import image_to_message
from tactile_msgs.msg import Contact, ContactRegion, Contacts, DotTracks, Slip
from visualization_msgs.msg import Marker


def circle(radius, n=60, z=0.0):
    angle = np.arange(n) * 2 * np.pi / n
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(n, z)], axis=1)


SIZES = {'dot_size': 6e-4, 'dot_colour': 'state', 'full_depth': 5e-3, 'normal_length': 6e-3, 'force_length': 8e-3, 'full_force': 4.0,
         'full_torque': 0.02, 'sensor_type': 'areal_single', 'dome.rim_radius': 0.0, 'dome.height': 0.0}
HEADER = Header(frame_id='pad')
NAN = float('nan')


def square(half):
    return Polygon(points=[Point32(x=x * half, y=y * half, z=0.012) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


def touch():
    wrench = WrenchStamped()
    wrench.wrench.force = Vector3(x=0.5, z=-2.0)
    wrench.wrench.torque = Vector3(x=NAN, y=NAN, z=NAN)
    return {'dots': DotTracks(id=[4, 7, 9], x=[0.0, 0.001, NAN], y=[0.0] * 3, z=[0.012] * 3),
            'contact_region': ContactRegion(dot_id=[4, 7], dot_state=[1, 2], outlines=[square(0.004)], holes=[square(0.001)],
                                            centroid=Point(x=0.001, z=0.012)),
            'contacts': Contacts(contacts=[Contact(id=3, position=Point(z=0.012), normal=Vector3(z=1.0))]),
            'slip': Slip(state=Slip.INCIPIENT, rotation_center=Point(x=0.002, y=0.0, z=NAN)), 'wrench': wrench}


def by_name(array):
    return {marker.ns: marker for marker in array.markers if marker.action == Marker.ADD}


def xyz(points):
    return np.array([(p.x, p.y, p.z) for p in points])


def test_every_part_is_drawn_in_the_sensor_frame_and_stays_while_data_come():
    made = by_name(DotMarkers(SIZES).frame(HEADER, touch()))
    assert set(made) == {'dots', 'outlines', 'holes', 'normals', 'force', 'slip_center', 'text'}  # the torque is not known
    assert all(m.header.frame_id == 'pad' and m.action == Marker.ADD for m in made.values())
    assert {(m.lifetime.sec, m.lifetime.nanosec) for m in made.values()} == {(2, 0)}
    assert all(m.pose.orientation.w == 1.0 for m in made.values())


def test_dots_have_the_colours_of_their_states_and_unknown_places_are_left_out():
    dots = by_name(DotMarkers(SIZES).frame(HEADER, touch()))['dots']
    assert len(dots.points) == len(dots.colors) == 2
    assert [(c.r, c.g, c.b) for c in dots.colors] == [pytest.approx(colours.STATE_COLOURS[s]) for s in (1, 2)]


def test_depth_is_under_the_untouched_dome_where_there_is_one():
    dome = {**SIZES, 'dot_colour': 'depth', 'sensor_type': 'air_cushion',
            'dome.rim_radius': 0.15, 'dome.height': 0.12}
    found = {'dots': DotTracks(id=[0, 1, 2], x=[0.0, 0.15, 0.0], y=[0.0] * 3, z=[0.12, 0.0, 0.1175])}
    dots = by_name(DotMarkers(dome).frame(HEADER, found))['dots']
    assert [(c.r, c.g, c.b) for c in dots.colors] == [pytest.approx(row, abs=1e-5) for row in colours.of_depth(np.array([0.0, 0.0, 0.5]))]
    pad = {**SIZES, 'dot_colour': 'depth', 'sensor_type': 'touchpad', 'cap.curvature_radius': 0.02, 'cap.height': 0.013}
    found = {'dots': DotTracks(id=[0, 1], x=[0.0, 0.0], y=[0.0, 0.0], z=[0.013, 0.008])}
    dots = by_name(DotMarkers(pad).frame(HEADER, found))['dots']
    assert [(c.r, c.g, c.b) for c in dots.colors] == [pytest.approx(row, abs=1e-5) for row in colours.of_depth(np.array([0.0, 1.0]))]


def test_a_touch_shows_where_it_is_with_95_percent():
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    covariance = turn @ np.diag([1e-8, 4e-8, 9e-8]) @ turn.T
    contact = Contact(id=3, position=Point(z=0.012), normal=Vector3(z=1.0), position_covariance=covariance.ravel())
    made = by_name(DotMarkers(SIZES).frame(HEADER, {'contacts': Contacts(contacts=[contact])}))['covariances']
    assert [made.scale.x, made.scale.y, made.scale.z] == pytest.approx([5.592e-4, 2 * 5.592e-4, 3 * 5.592e-4], rel=1e-3)
    q = made.pose.orientation
    axis = Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()[:, 0]
    assert abs(axis @ turn[:, 0]) == pytest.approx(1.0)
    unknown = Contact(id=3, position_covariance=[NAN] * 9)
    assert 'covariances' not in by_name(DotMarkers(SIZES).frame(HEADER, {'contacts': Contacts(contacts=[unknown])}))


def test_each_array_takes_away_all_that_was_before():
    # RViz handles the markers of an array one after the other between two pictures; without a namespace DELETEALL is for all of them.
    it = DotMarkers(SIZES)
    for found in (touch(), {'dots': touch()['dots'], 'contact_region': ContactRegion()}, {}):
        first, *others = it.frame(HEADER, found).markers
        assert first.action == Marker.DELETEALL and first.ns == '' and {m.action for m in others} == {Marker.ADD}
        assert len({(m.ns, m.id) for m in others}) == len(others), 'RViz complains of two of one name'
    assert {m.ns for m in others} == {'text'}


def test_name_numbers_and_state_stand_in_front_of_the_sensor():
    found = touch()
    found['contacts'].contacts[0].depth = 0.0013
    found['slip'].state = Slip.GROSS
    it = DotMarkers(SIZES)
    text = by_name(it.frame(HEADER, found))['text']
    assert text.text == 'pad\n1.3 mm deep\n2.1 N\ngross slip'
    assert (text.color.r, text.color.g, text.color.b) == pytest.approx(colours.STATE_COLOURS[2])
    assert text.pose.position.x > 0.001 and text.pose.position.y > 0, 'towards the camera centre of the configurations'
    assert by_name(it.frame(HEADER, {'dots': found['dots']}))['text'].text == 'pad'


def test_a_warning_is_shown_with_and_without_data_until_it_is_over():
    it = DotMarkers(SIZES)
    it.warning = 'the first dots are off their untouched positions, something may press; let go and call set_reference'
    for made in (it.frame(HEADER, touch()), it.alone(HEADER)):
        assert by_name(made)['warning'].text.replace('\n', ' ') == it.warning
    it.warning = ''
    assert 'warning' not in by_name(it.frame(HEADER, touch()))


SIZES_FINGER = {'radius': 0.016, 'point_size': 1.5e-3, 'normal_length': 8e-3}


def reported(stamp, *contacts):
    message = Contacts(header=Header(frame_id='finger'), contacts=[
        Contact(id=number, position=Point(x=0.016 * np.sin(a), z=0.016 * np.cos(a)), normal=Vector3(x=np.sin(a), z=np.cos(a)),
                position_covariance=(1e-8 * np.eye(3)).ravel()) for number, a in contacts])
    message.header.stamp.sec, message.header.stamp.nanosec = int(stamp), round(stamp % 1 * 1e9)
    return message


def drawn(markers, message):
    return {(m.ns, m.id): m for m in markers.frame(message.header, {'contacts': message}).markers if m.action == Marker.ADD}


def test_a_touch_its_normal_and_its_uncertainty():
    found = drawn(FingerMarkers(SIZES_FINGER), reported(5.0, (3, 0.9)))
    assert set(found) == {('finger', 0), ('points', 0), ('normals', 3), ('covariances', 3), ('text', 0)}
    assert found['points', 0].points[0].x == pytest.approx(0.016 * np.sin(0.9)) and found['finger', 0].scale.z == 0.032
    ends = found['normals', 3].points
    assert ends[1].z - ends[0].z == pytest.approx(8e-3 * np.cos(0.9))
    assert {m.header.frame_id for m in found.values()} == {'finger'}


def test_the_picture_shows_where_the_finger_is_touched():
    message = reported(5.0, (1, np.pi / 6))
    message.contacts.append(Contact(normal=Vector3(x=float('nan'), y=float('nan'), z=float('nan'))))
    made, empty = (finger_picture({'contacts': each}) for each in (message, Contacts()))
    assert made.shape == empty.shape
    rows, columns = np.nonzero((made != empty).any(axis=2)[:made.shape[1]])
    assert (columns.mean() / made.shape[1], rows.mean() / made.shape[1]) == pytest.approx((0.5 + 0.5 * 160 / 360, 0.5), abs=0.01)


SIZES_TAXEL = {'pitch': 1e-3, 'cell_height': 2e-3, 'full_value': 100.0, 'normal_length': 6e-3, 'force_length': 9e-3, 'full_force': 10.0,
         'full_torque': 1.0, 'flow_scale': 0.5}

def drawn_taxel(markers, **found):
    return {m.ns: m for m in markers.frame(HEADER, found).markers if m.action == Marker.ADD}


def test_pressed_taxels_are_squares_in_full_colour_on_a_plate():
    values = np.zeros((3, 4), np.uint8)
    values[1, 2], values[2, 3] = 100, 1
    found = drawn_taxel(TaxelMarkers(SIZES_TAXEL), image_raw=image_to_message(Frame(values, 0, 'mono8'), '', HEADER))
    plate, cells = found['plate'], found['cells']
    assert (plate.scale.x, plate.scale.y, cells.scale.x) == pytest.approx((4e-3, 3e-3, 1e-3)) and cells.type == Marker.POINTS
    place, = xyz(cells.points)
    assert place[:2] == pytest.approx((0.5e-3, 0.0)), 'of row 1, column 2'
    assert plate.pose.position.z + 0.5 * plate.scale.z < place[2] < 0, 'under the outlines, at z = 0'
    assert [(c.r, c.g, c.b) for c in cells.colors] == [pytest.approx(colours.of_depth(np.ones(1))[0])]
