# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from geometry_msgs.msg import Point, Point32, Polygon, Vector3, WrenchStamped
from scipy.spatial.transform import Rotation
from std_msgs.msg import Header
from tactile_bringup.visualization import pictures as colours
from tactile_bringup.visualization.markers import MarkerSet
from tactile_msgs.msg import Contact, ContactRegion, Contacts, DotTracks, Slip
from visualization_msgs.msg import Marker

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
    made = by_name(MarkerSet(SIZES).frame(HEADER, touch()))
    assert set(made) == {'dots', 'outlines', 'holes', 'region', 'normals', 'force', 'slip_center', 'text'}  # the torque is not known
    assert all(m.header.frame_id == 'pad' and m.action == Marker.ADD for m in made.values())
    assert {(m.lifetime.sec, m.lifetime.nanosec) for m in made.values()} == {(2, 0)}
    assert all(m.pose.orientation.w == 1.0 for m in made.values())


def test_dots_have_the_colours_of_their_states_and_unknown_places_are_left_out():
    dots = by_name(MarkerSet(SIZES).frame(HEADER, touch()))['dots']
    assert len(dots.points) == len(dots.colors) == 2
    assert [(c.r, c.g, c.b) for c in dots.colors] == [pytest.approx(colours.STATE_COLOURS[s]) for s in (1, 2)]


def test_dots_may_have_the_colours_of_their_depths():
    found = {'dots': DotTracks(id=[0, 1, 2], x=[0.0, 0.001, 0.002], y=[0.0] * 3, z=[0.0, -0.005, -0.02])}
    dots = by_name(MarkerSet({**SIZES, 'dot_colour': 'depth'}).frame(HEADER, found))['dots']
    assert [(c.r, c.g, c.b) for c in dots.colors] == [pytest.approx(row) for row in colours.of_depth(np.array([0.0, 1.0, 1.0]))]
    assert dots.colors[0] != dots.colors[1]


def test_depth_is_under_the_untouched_dome_where_there_is_one():
    dome = {**SIZES, 'dot_colour': 'depth', 'sensor_type': 'air_cushion',
            'dome.rim_radius': 0.15, 'dome.height': 0.12}
    found = {'dots': DotTracks(id=[0, 1, 2], x=[0.0, 0.15, 0.0], y=[0.0] * 3, z=[0.12, 0.0, 0.1175])}
    dots = by_name(MarkerSet(dome).frame(HEADER, found))['dots']
    assert [(c.r, c.g, c.b) for c in dots.colors] == [pytest.approx(row, abs=1e-5) for row in colours.of_depth(np.array([0.0, 0.0, 0.5]))]
    pad = {**SIZES, 'dot_colour': 'depth', 'sensor_type': 'touchpad', 'cap.curvature_radius': 0.02, 'cap.height': 0.013}
    found = {'dots': DotTracks(id=[0, 1], x=[0.0, 0.0], y=[0.0, 0.0], z=[0.013, 0.008])}
    dots = by_name(MarkerSet(pad).frame(HEADER, found))['dots']
    assert [(c.r, c.g, c.b) for c in dots.colors] == [pytest.approx(row, abs=1e-5) for row in colours.of_depth(np.array([0.0, 1.0]))]


def test_a_touch_shows_where_it_is_with_95_percent():
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    covariance = turn @ np.diag([1e-8, 4e-8, 9e-8]) @ turn.T
    contact = Contact(id=3, position=Point(z=0.012), normal=Vector3(z=1.0), position_covariance=covariance.ravel())
    made = by_name(MarkerSet(SIZES).frame(HEADER, {'contacts': Contacts(contacts=[contact])}))['covariances']
    assert [made.scale.x, made.scale.y, made.scale.z] == pytest.approx([5.592e-4, 2 * 5.592e-4, 3 * 5.592e-4], rel=1e-3)
    q = made.pose.orientation
    axis = Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()[:, 0]
    assert abs(axis @ turn[:, 0]) == pytest.approx(1.0)
    unknown = Contact(id=3, position_covariance=[NAN] * 9)
    assert 'covariances' not in by_name(MarkerSet(SIZES).frame(HEADER, {'contacts': Contacts(contacts=[unknown])}))


def test_the_fill_spares_the_hole():
    corners = xyz(by_name(MarkerSet(SIZES).frame(HEADER, touch()))['region'].points).reshape(-1, 3, 3)
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    assert area == pytest.approx(0.008**2 - 0.002**2, rel=1e-5)


def test_arrows_have_their_lengths():
    made = by_name(MarkerSet(SIZES).frame(HEADER, touch()))
    start, end = xyz(made['normals'].points)
    assert made['normals'].id == 3 and end - start == pytest.approx([0, 0, 6e-3])
    start, end = xyz(made['force'].points)
    assert end - start == pytest.approx([0.5 * 2e-3, 0, -2.0 * 2e-3])
    away = np.array([0.001, 0, 0.012]) - end
    assert np.linalg.norm(away) == pytest.approx(6e-3) and np.cross(away, end - start) == pytest.approx(np.zeros(3)), 'off the touch'


def grid_of_dots(depth=0.0):
    x, y = (part.ravel() * 1e-3 for part in np.meshgrid(np.arange(4.0), np.arange(3.0)))
    z = np.where((x == 1e-3) & (y == 1e-3), -depth, 0.0)
    return DotTracks(id=range(12), x=x, y=y, z=z)


def test_the_skin_spans_the_dots_and_shows_a_dent_by_colour_and_light():
    flat, dented = (by_name(MarkerSet(SIZES).frame(HEADER, {'dots': grid_of_dots(depth)}))['skin'] for depth in (0.0, 2e-3))
    assert len(flat.points) == len(flat.colors) == 3 * 2 * 3 * 2 and flat.type == Marker.TRIANGLE_LIST
    corners = xyz(flat.points).reshape(-1, 3, 3)
    assert 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() == pytest.approx(6e-6)
    assert all(0 < c.a < 1 for c in flat.colors) and flat.color.a == 1.0
    assert len({(c.r, c.g, c.b) for c in flat.colors}) == 1 < len({(c.r, c.g, c.b) for c in dented.colors})


def test_a_dot_whose_place_is_not_known_leaves_the_skin_whole():
    found = {'dots': grid_of_dots()}
    it = MarkerSet(SIZES)
    it.frame(HEADER, found)
    found['dots'].x[5] = NAN
    assert np.isfinite(xyz(by_name(it.frame(HEADER, found))['skin'].points)).all()
    assert 'skin' not in by_name(it.frame(HEADER, {'dots': DotTracks(id=[0, 1], x=[0.0, 1.0], y=[0.0, 0.0], z=[0.0, 0.0])}))


def test_each_array_takes_away_all_that_was_before():
    # RViz handles the markers of an array one after the other between two pictures; without a namespace DELETEALL is for all of them.
    it = MarkerSet(SIZES)
    for found in (touch(), {'dots': touch()['dots'], 'contact_region': ContactRegion()}, {}):
        first, *others = it.frame(HEADER, found).markers
        assert first.action == Marker.DELETEALL and first.ns == '' and {m.action for m in others} == {Marker.ADD}
        assert len({(m.ns, m.id) for m in others}) == len(others), 'RViz complains of two of one name'
    assert {m.ns for m in others} == {'text'}


@pytest.mark.parametrize('newton', [0.01, 0.7, 40.0])
def test_an_arrow_has_a_shaft_however_short_it_is(newton):
    found = touch()
    found['wrench'].wrench.force = Vector3(z=-newton)
    arrow = by_name(MarkerSet(SIZES).frame(HEADER, found))['force']
    length = float(np.linalg.norm(np.diff(xyz(arrow.points), axis=0)))
    head = min(arrow.scale.z, length)  # RViz: the rest is the shaft
    assert 0 < head < 0.5 * length and arrow.scale.x < arrow.scale.y <= length


def test_name_numbers_and_state_stand_in_front_of_the_sensor():
    found = touch()
    found['contacts'].contacts[0].depth = 0.0013
    found['slip'].state = Slip.GROSS
    it = MarkerSet(SIZES)
    text = by_name(it.frame(HEADER, found))['text']
    assert text.text == 'pad\n1.3 mm deep\n2.1 N\ngross slip'
    assert (text.color.r, text.color.g, text.color.b) == pytest.approx(colours.STATE_COLOURS[2])
    assert text.pose.position.x > 0.001 and text.pose.position.y > 0, 'towards the eye of the configurations'
    assert by_name(it.frame(HEADER, {'dots': found['dots']}))['text'].text == 'pad'


def test_a_warning_is_shown_with_and_without_data_until_it_is_over():
    it = MarkerSet(SIZES)
    it.warning = 'the first dots are off their untouched positions, something may press; let go and call set_reference'
    for made in (it.frame(HEADER, touch()), it.nothing(HEADER)):
        assert by_name(made)['warning'].text.replace('\n', ' ') == it.warning
    it.warning = ''
    assert 'warning' not in by_name(it.frame(HEADER, touch()))
