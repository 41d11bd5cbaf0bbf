# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Markers, pictures, and the RViz files that show them."""
import pathlib

import numpy as np
import pytest
import yaml
from geometry_msgs.msg import Point, Point32, Polygon, Vector3, WrenchStamped
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from tactile_bringup.hand.configurations import moved_file, rviz_configuration, text_parameters
from tactile_bringup.hand.description import Hand, HandSensor
from tactile_bringup.visualization import pictures as colours
from tactile_bringup.visualization.constants import COLOURS
from tactile_bringup.visualization.markers import DotMarkers, FingerMarkers, TaxelMarkers
from tactile_bringup.visualization.pictures import (
    ARRAY_LEGEND,
    Annotation,
    annotate,
    annotation_of,
    finger_picture,
    plane_projection,
    projection,
)
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import image_to_message
from tactile_driver.stitching.calibration import SideView, Stitching
from tactile_msgs.msg import Contact, ContactRegion, Contacts, DotTracks, Slip
from tactile_perception.common.messages import points_to_message
from tactile_perception.common.surface_points import SurfacePoints
from tactile_perception.core.messages import camera_matrices


def circle(radius, n=60, z=0.0):
    angle = np.arange(n) * 2 * np.pi / n
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(n, z)], axis=1)


TEXT = {'text.height': 0.0, 'text.side': [1.0, 1.0, 0.0], 'text.up': [0.0, 0.0, 1.0]}
SIZES = {**TEXT, 'dot_size': 6e-4, 'dot_colour': 'state', 'full_depth': 5e-3, 'normal_length': 6e-3, 'force_length': 8e-3,
         'full_force': 4.0, 'full_torque': 0.02, 'sensor_type': 'areal_single', 'dome.rim_radius': 0.0, 'dome.height': 0.0}
DOME = {**SIZES, 'dot_colour': 'depth', 'sensor_type': 'air_cushion', 'dome.rim_radius': 0.15, 'dome.height': 0.12}
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
    assert [(c.r, c.g, c.b) for c in dots.colors] == [pytest.approx(COLOURS.states[s]) for s in (1, 2)]


def test_dots_without_positions_stand_where_the_points_are():
    xyz_of = np.array([(0.001, 0.002, -1e-4), (0.003, 0.004, 0.0)])
    zeros = np.zeros((2, 3))
    cloud = points_to_message(SurfacePoints((1, 2), xyz_of, zeros, zeros, zeros, np.zeros(2), np.zeros(2, np.uint8)), HEADER)
    found = {'dots': DotTracks(id=[3, 8]), 'points': cloud, 'contact_region': ContactRegion(dot_id=[8], dot_state=[1])}
    dots = by_name(DotMarkers(SIZES).frame(HEADER, found))['dots']
    assert xyz(dots.points) == pytest.approx(xyz_of, abs=1e-9)
    assert [c.g for c in dots.colors] == pytest.approx([COLOURS.states[state][1] for state in (0, 1)])
    assert 'dots' not in by_name(DotMarkers(SIZES).frame(HEADER, {'dots': DotTracks(id=[3, 8, 9]), 'points': cloud})), 'of another frame'


def test_depth_is_under_the_untouched_dome_where_there_is_one():
    found = {'dots': DotTracks(id=[0, 1, 2], x=[0.0, 0.15, 0.0], y=[0.0] * 3, z=[0.12, 0.0, 0.1175])}
    dots = by_name(DotMarkers(DOME).frame(HEADER, found))['dots']
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


def lines(array, ns='text'):
    return [marker for marker in array.markers if marker.ns == ns]


def test_name_numbers_and_state_stand_in_front_of_the_sensor():
    found = touch()
    found['contacts'].contacts[0].depth = 0.0013
    found['slip'].state = Slip.GROSS
    it = DotMarkers(SIZES)
    text = lines(it.frame(HEADER, found))
    assert [line.text for line in text] == ['pad', '1.3 mm deep', '2.1 N', 'gross slip']
    assert (text[0].color.r, text[0].color.g, text[0].color.b) == pytest.approx(COLOURS.states[2])
    positions = xyz(line.pose.position for line in text)
    assert (positions[:, :2] > 0.001).all(), 'towards the camera centre of the configurations'
    steps = np.diff(positions, axis=0) / text[0].scale.z
    assert steps == pytest.approx(np.tile([0.0, 0.0, -1.7], (3, 1))), 'a marker a line, 1.7 letter heights apart'
    alone, = lines(it.frame(HEADER, {'dots': found['dots']}))
    assert alone.text == 'pad' and alone.pose == text[0].pose, 'the first line stays where it is when a contact begins'


def test_the_text_of_a_sensor_of_a_hand_is_short_and_beside_the_sensor():
    found = touch()
    found['contacts'].contacts[0].depth = 0.0013
    it = DotMarkers({**SIZES, 'text.height': 0.005, 'text.side': [0.0, -1.0, 0.0], 'text.up': [1.0, 0.0, 0.0]})
    it.warning = 'no frame for 2.0 s; check the sensor and its cable'
    made = it.frame(HEADER, found)
    assert [line.text for line in lines(made)] == ['pad', '1.3 mm, 2.1 N'] and lines(made)[0].scale.z == 0.005
    assert [line.text for line in lines(made, 'warning')] == ['no frame for 2.0 ...']
    positions = xyz(line.pose.position for line in [*lines(made), *lines(made, 'warning')])
    assert positions[:, 1] == pytest.approx(positions[0, 1]) and positions[0, 1] < -0.006 - 0.015
    assert np.diff(positions[:, 0]) == pytest.approx([-1.7 * 0.005] * 2) and positions[1, 0] == pytest.approx(0.0)


def test_a_warning_is_shown_with_and_without_data_until_it_is_over():
    it = DotMarkers(SIZES)
    it.warning = 'the first dots are off their untouched positions, something may press; let go and call set_reference'
    for made in (it.frame(HEADER, touch()), it.alone(HEADER)):
        said = lines(made, 'warning')
        assert len(said) == 2 and it.warning.startswith(' '.join(line.text for line in said).removesuffix(' ...'))
        assert said[0].pose.position.z > said[1].pose.position.z > 0.004, 'above the sensor'
    it.warning = ''
    assert not lines(it.frame(HEADER, touch()), 'warning')


def test_a_warning_stands_over_a_dome():
    it = DotMarkers(DOME)
    it.warning = 'the first dots are off their untouched positions, something may press; let go and call set_reference'
    said = lines(it.frame(HEADER, {'dots': DotTracks(id=[0, 1], x=[0.0, 0.11], y=[0.0] * 2, z=[0.12, 0.04])}), 'warning')
    assert len(said) == 2 and said[1].pose.position.z > 0.12


def test_the_normal_of_a_contact_on_the_flank_of_a_dome_begins_within_its_outline():
    """The lowest point of a ball on a slope is beside the contact."""
    def moved(x):
        return Polygon(points=[Point32(x=float(x + a), y=float(b), z=0.1) for a, b, _ in circle(0.004)])

    contacts = [Contact(id=number, position=Point(x=x, z=0.1), normal=Vector3(z=1.0)) for number, x in ((3, 0.057), (5, -0.06))]
    found = {'contacts': Contacts(contacts=contacts), 'contact_region': ContactRegion(outlines=[moved(-0.054), moved(0.05)])}
    feet = {sizes['sensor_type']: [marker.points[0].x for marker in lines(DotMarkers(sizes).frame(HEADER, found), 'normals')]
            for sizes in (DOME, SIZES)}
    assert feet['air_cushion'] == pytest.approx([0.05, -0.054]) and feet['areal_single'] == pytest.approx([0.057, -0.06])


SIZES_FINGER = {**TEXT, 'radius': 0.016, 'point_size': 1.5e-3, 'normal_length': 8e-3}


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
    assert found['finger', 0].type == Marker.SPHERE_LIST and xyz(found['finger', 0].points).tolist() == [[0.0, 0.0, 0.0]]
    assert set(found) == {('finger', 0), ('points', 0), ('normals', 3), ('covariances', 3),
                          *(('text', number) for number in range(3))}
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


SIZES_TAXEL = {**TEXT, 'pitch': 1e-3, 'cell_height': 2e-3, 'full_value': 100.0, 'normal_length': 6e-3, 'force_length': 9e-3,
               'full_force': 10.0, 'full_torque': 1.0, 'flow_scale': 0.5}

def drawn_taxel(markers, **found):
    return {m.ns: m for m in markers.frame(HEADER, found).markers if m.action == Marker.ADD}


def test_pressed_taxels_are_squares_in_full_colour_on_a_plate():
    values = np.zeros((3, 4), np.uint8)
    values[1, 2], values[2, 3] = 100, 1
    found = drawn_taxel(TaxelMarkers(SIZES_TAXEL), image_raw=image_to_message(Frame(values, 0, 'mono8'), '', HEADER))
    plate, cells = found['plate'], found['cells']
    assert plate.type == cells.type == Marker.TRIANGLE_LIST and np.ptp(xyz(plate.points), axis=0) == pytest.approx((4e-3, 3e-3, 0.0))
    corners = xyz(cells.points)
    assert corners.mean(axis=0)[:2] == pytest.approx((0.5e-3, 0.0)), 'of row 1, column 2'
    assert np.ptp(corners, axis=0) == pytest.approx((1e-3, 1e-3, 0.0)) and len(corners) == 6, 'two triangles'
    assert plate.points[0].z < corners[0, 2] < 0, 'under the outlines, at z = 0'
    assert [(c.r, c.g, c.b) for c in cells.colors] == [pytest.approx(colours.of_depth(np.ones(1))[0])] * 6


GREY = np.full((480, 640), 100, np.uint8)


def changed(image, ground=100):
    """(H, W) whether a pixel differs from the even ground."""
    return (image != ground).any(axis=2)


def dots_at(*positions, moved=(0.0, 0.0), state=0):
    uv = np.array(positions, float)
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
    assert (result == colours.bgr(COLOURS.states[state])).all(axis=2).any()
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
    assert (result[100, 150] == colours.bgr(COLOURS.region)).all()
    assert (result[150, 140] == colours.bgr(COLOURS.hole)).all()
    expected = 0.78 * 100 + 0.22 * np.array(colours.bgr(COLOURS.region))
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


def test_positions_near_a_plane_of_known_dots_appear_between_them():
    dots = np.array([(0.0, 0.0, 0.0), (0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (0.01, 0.01, 0.0), (NAN, NAN, NAN)])
    uv = np.array([(300.0, 200.0), (400.0, 210.0), (290.0, 300.0), (390.0, 310.0), (5.0, 5.0)])
    assert plane_projection(dots, uv)(np.array([(0.005, 0.005, -0.001), (0.02, 0.0, 0.0)])) == pytest.approx(
        np.array([(345.0, 255.0), (500.0, 220.0)]))
    assert plane_projection(dots[-3:], uv[-3:]) is None, 'of two points'


def camera_at(x):
    return SideView((640, 480), np.eye(3), np.zeros(5), np.eye(3), np.array([x, 0.0, -0.05]))


def test_places_in_a_stitched_picture_by_hand():
    """Two cameras 5 cm under the sheet and 4 cm apart, 10 px/mm: what lies 1 cm under it is seen a quarter further from the camera centre;
    what lies across the seam is drawn in one piece."""
    stitching = Stitching(camera_at(-0.02), camera_at(0.02), (1200, 900), 1e4, np.array([600.0, 450.0]), 600.0, (500.0, 100.0))
    project = projection(None, [0.0] * 3, [0.0] * 3, stitching)
    for x, u in ((-0.03, 600 - 325), (0.03, 600 + 325)):
        assert project(np.array([(x, 0.02, -0.01)]))[0] == pytest.approx((u, 450 + 250))
    across = project(np.array([(-0.02, -0.01, 0.0), (-0.01, 0.0, -0.01), (0.01, 0.0, -0.01)]))
    assert across == pytest.approx(np.array([(400, 350), (600 - 75, 450), (600 + 175, 450)]))


def test_a_contact_of_unknown_depth_is_no_missing_contact():
    contacts = Contacts(contacts=[Contact(depth=NAN, force=NAN)])
    what = annotation_of({'dots': DOTS, 'contact_region': ContactRegion(), 'contacts': contacts}, CAMERA)
    assert what.text[-1] == 'contact, its depth and force are not known'
    what = annotation_of({'dots': DOTS, 'contact_region': ContactRegion(), 'contacts': Contacts()}, CAMERA)
    assert what.text[-1] == 'nothing touches'


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


PACKAGE = pathlib.Path(__file__).resolve().parents[2]
SENSORS = 'touchpad', 'areal_single', 'areal_dual', 'air_cushion', 'psd_finger', 'taxel_array', 'force_taxels'
ONE_CAMERA = {'touchpad', 'areal_single', 'air_cushion'}


def shipped(name):
    return yaml.safe_load((PACKAGE / 'rviz' / f'{name}.rviz').read_text())


@pytest.fixture(params=SENSORS)
def sensor(request):
    return request.param


def test_topics_and_frame_are_those_of_the_sensor(sensor):
    page = shipped(sensor)
    assert page['Visualization Manager']['Global Options']['Fixed Frame'] == sensor
    topics = {(each['Class'].split('/')[1], each['Topic']['Value'].removeprefix(f'/{sensor}/'), each['Enabled'])
              for each in page['Visualization Manager']['Displays'] if 'Topic' in each}
    expected = {('MarkerArray', 'markers', True), ('Image', 'image_annotated', True)}
    if sensor != 'psd_finger':
        expected.add(('PointCloud2', 'points', False))
    if sensor not in ('psd_finger', 'force_taxels'):
        expected.add(('Image', 'image_raw', True))
    if sensor in ONE_CAMERA:
        expected.add(('Camera', 'image_raw', False))
    assert topics == expected
    assert all(each['Enabled'] == each['Value'] for each in page['Visualization Manager']['Displays'])


def test_another_namespace_takes_the_place_of_the_type(sensor):
    page = yaml.safe_load(moved_file(sensor, 'left/pad', 'left_pad'))
    assert page['Visualization Manager']['Global Options']['Fixed Frame'] == 'left_pad'
    topics = [each['Topic']['Value'] for each in page['Visualization Manager']['Displays'] if 'Topic' in each]
    assert topics and all(topic.startswith('/left/pad/') for topic in topics)
    assert page['Window Geometry'] == shipped(sensor)['Window Geometry']


def test_the_text_of_a_sensor_of_a_hand_is_upright_and_away_from_the_others():
    quarter = (0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5))  # about y: the sensor's z is the hand's x
    hand = Hand('palm', (HandSensor('thumb', 'touchpad', 'palm', (0.1, 0.0, 0.0), quarter),
                         HandSensor('tip', 'psd_finger', 'thumb', (0.0, 0.0, -0.2))))
    thumb, tip = (text_parameters(hand, sensor) for sensor in hand.sensors)
    for turned in (thumb, tip):
        assert turned['text.up'] == pytest.approx([-1.0, 0.0, 0.0]), 'the hand z in a sensor frame'
    assert thumb['text.side'] == pytest.approx([0.0, 0.0, 1.0]), 'in front of the sensor'
    assert tip['text.side'] == pytest.approx([-0.3, 0.0, -1.0]), 'behind the sensor, and higher'
    assert thumb['text.height'] == tip['text.height'] == pytest.approx(0.018 * (0.2 + 0.1))


def test_every_sensor_of_a_hand_has_its_markers_and_its_picture_in_the_frame_of_the_hand():
    hand = Hand('palm', (HandSensor('left/thumb', 'touchpad', 'palm', (0.1, 0.0, 0.0)),
                         HandSensor('tip', 'psd_finger', 'left_thumb', (-0.2, 0.0, 0.0))))
    manager = yaml.safe_load(rviz_configuration(hand))['Visualization Manager']
    shown = {each['Topic']['Value'] for each in manager['Displays'] if 'Topic' in each}
    assert shown == {'/left/thumb/markers', '/tip/markers', '/left/thumb/image_annotated', '/tip/image_annotated'}
    assert manager['Global Options']['Fixed Frame'] == 'palm'
    window = yaml.safe_load(rviz_configuration(hand))['Window Geometry']
    state = bytes.fromhex(window['QMainWindow State'])
    assert (window['Width'], window['Height']) == (1600, 960)
    assert all(state.count(name.encode('utf-16-be')) == 1 for name in ('Displays', 'left/thumb: annotated', 'tip: annotated'))
    view = manager['Views']['Current']
    assert [view['Focal Point'][axis] for axis in 'XYZ'] == pytest.approx([0.0, 0.0, 0.01], abs=0.03), 'they hang on each other'
