# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Messages and arrays: what is checked, and what goes through a message and back."""
from array import array

import numpy as np
import pytest
from geometry_msgs.msg import Point, Point32, Polygon, Vector3, Wrench, WrenchStamped
from sensor_msgs.msg import CameraInfo, Image, PointField
from std_msgs.msg import Header

from tactile_driver.recordings.serialization import encode, type_name_of
from tactile_msgs.msg import Contact, ContactRegion, Contacts, DotTracks, Slip
from tactile_perception.common import dots as estimated, messages as convert
from tactile_perception.common.estimates import ContactEstimate, ContactRegionEstimate, SlipEstimate
from tactile_perception.common.messages import points_to_message
from tactile_perception.common.surface_points import UNKNOWN, SurfacePoints
from tactile_perception.core.errors import BadFrame
from tactile_perception.core.messages import camera_matrices, check_message

HEADER = Header(frame_id='pad')
HEADER.stamp.sec, HEADER.stamp.nanosec = 12, 500_000_000


def some_tracks(xyz=True):
    uv = np.array([[10.5, 20.25], [30.0, 40.0]])
    duv, xyz_m = np.array([[1.0, 2.0], [np.nan, np.nan]]), np.array([[0.001, 0.002, 0.01], [np.nan] * 3])
    return estimated.DotTracks(2, 3, np.array([1, 5]), uv, np.array([80.0, np.nan]), np.array([0.02, 0.03]), duv, xyz_m if xyz else None)


def test_tracks_go_through_a_message_and_back():
    there = convert.tracks_to_message(some_tracks(), HEADER)
    back = convert.tracks_from_message(there)
    assert there.header.frame_id == 'pad' and (back.rows, back.columns) == (2, 3)
    for name in ('id', 'uv', 'area', 'duv', 'xyz'):
        assert getattr(back, name) == pytest.approx(getattr(some_tracks(), name), rel=1e-7, nan_ok=True)
    assert np.isnan(back.sigma).all()
    assert convert.tracks_from_message(convert.tracks_to_message(some_tracks(xyz=False), HEADER)).xyz is None


def test_nothing_touching_is_nan_and_empty_not_zero():
    region = convert.region_to_message(ContactRegionEstimate(np.array([3]), np.array([0], np.uint8)), HEADER)
    assert region.area == 0 and not region.outlines and list(region.dot_id) == [3]
    unknown = [region.centroid.x, region.normal.z, region.orientation, region.major_axis, region.motion.rotation.w, region.motion_interval]
    assert np.isnan(unknown).all()
    slip = convert.slip_to_message(SlipEstimate(), HEADER)
    assert slip.state == slip.NONE and np.isnan([slip.slipping_fraction, slip.velocity.linear.x, slip.rotation_center.y]).all()
    assert convert.contacts_to_message([], HEADER).contacts == []


def test_a_camera_of_zeros_is_uncalibrated_and_another_model_is_refused():
    info = CameraInfo(k=[700.0, 0, 320, 0, 710, 240, 0, 0, 1], d=[0.1, 0.2, 0.0, 0.0], distortion_model='plumb_bob')
    matrix, distortion = camera_matrices(info)
    assert matrix[1, 1] == 710 and list(distortion) == [0.1, 0.2, 0, 0, 0]
    assert camera_matrices(CameraInfo()) is None
    info.distortion_model = 'equidistant'
    with pytest.raises(BadFrame, match='equidistant'):
        camera_matrices(info)
    info.distortion_model, info.d = 'plumb_bob', [0.0] * 8
    with pytest.raises(BadFrame, match='8 distortion'):
        camera_matrices(info)


def same(a, b, names):
    for name in names:
        for one, other in zip(np.atleast_1d(getattr(a, name)), np.atleast_1d(getattr(b, name))):
            np.testing.assert_allclose(one, other, rtol=1e-6, equal_nan=True)


def test_contacts():
    made = [ContactEstimate(3, np.array([1e-3, 2e-3, 3e-3]), np.array([0, 0, 1.0]), 1e-3, np.nan, np.diag([1e-8, 2e-8, 3e-8]), 5, None)]
    back = convert.contacts_from_message(convert.contacts_to_message(made, HEADER))
    assert len(back) == 1 and len(back[0].members) == 0
    same(made[0], back[0], ('id', 'position', 'normal', 'depth', 'force', 'position_covariance', 'flags'))


def test_a_region():
    loop = np.array([[0, 0, 0], [1e-3, 0, 0], [0, 1e-3, 0]])
    made = ContactRegionEstimate(np.array([4, 7]), np.array([1, 2], np.uint8), [loop], [loop / 2], 1e-6, np.ones(3), np.array([0, 0, 1.0]),
                                 0.1, 2e-3, 1e-3, np.zeros(3), np.array([0, 0, 0, 1.0]), 0.05, np.diag(np.arange(6.0)))
    back = convert.region_from_message(convert.region_to_message(made, HEADER))
    same(made, back, ('dot_id', 'dot_state', 'outlines', 'holes', 'area', 'centroid', 'normal', 'orientation', 'major_axis', 'minor_axis',
                      'motion_translation', 'motion_rotation', 'motion_interval', 'motion_covariance'))


def test_slip_and_wrench():
    made = SlipEstimate(1, 0.5, np.arange(3.0), np.arange(3.0), np.eye(6), np.full(3, np.nan), *(np.arange(2.0) + k for k in range(4)))
    back = convert.slip_from_message(convert.slip_to_message(made, HEADER))
    same(made, back, ('state', 'slipping_fraction', 'linear', 'angular', 'velocity_covariance', 'rotation_center', 'x', 'y', 'vx', 'vy'))
    assert convert.wrench_from_message(convert.wrench_to_message(np.arange(6.0), HEADER)).tolist() == [0, 1, 2, 3, 4, 5]


@pytest.mark.parametrize('frame', ['', 'pad', 'left_thumb_pad'])
def test_written_messages_are_the_bytes_that_the_middleware_makes(frame):
    header, rng = Header(frame_id=frame, stamp=HEADER.stamp), np.random.default_rng(1)
    loops = [rng.normal(size=(count, 3)) for count in (3, 0, 1)]
    region = ContactRegionEstimate(np.arange(3), np.arange(3, dtype=np.uint8), loops, loops[:1], 0.1, *rng.normal(size=(2, 3)),
                                   *rng.normal(size=3), dot_confidence=rng.uniform(size=3))
    unknown = ContactRegionEstimate(np.zeros(0), np.zeros(0))
    contacts = [ContactEstimate(k, *rng.normal(size=(2, 3)), 1e-3, np.nan, rng.normal(size=(3, 3)), k, None) for k in range(3)]
    slip = SlipEstimate(2, 0.3, *rng.normal(size=(2, 3)), rng.normal(size=(6, 6)), rng.normal(size=3), *rng.normal(size=(4, 5)), 0.7)
    for written in (*(convert.tracks_to_message(some_tracks(xyz), header) for xyz in (True, False)), convert.slip_to_message(slip, header),
                    *(convert.region_to_message(one, header) for one in (region, unknown)), convert.slip_to_message(SlipEstimate(), header),
                    *(convert.contacts_to_message(contacts[:count], header) for count in (0, 1, 3)),
                    convert.wrench_to_message(np.arange(6), header), points_to_message(some_points(), header)):
        assert encode(written) == (type_name_of(written.kind), encode(written.message)[1])
        assert written.header == header and isinstance(written.message, written.kind)


NAN = float('nan')


def floats(*values):
    return array('f', values)


def dots(**changes):
    good = {'rows': 2, 'columns': 3, 'id': array('I', [1, 5]), 'u': floats(1, 2), 'v': floats(3, 4), 'area': floats(80, NAN),
            'du': floats(0, NAN), 'dv': floats(0, NAN), 'x': floats(0, NAN), 'y': floats(0, NAN), 'z': floats(0, NAN)}
    return DotTracks(**{**good, **changes})


def test_valid_and_unknown_values_pass():
    unknown = Point(x=NAN, y=NAN, z=NAN)
    for message in (dots(), dots(x=floats(), y=floats(), z=floats()), DotTracks(), ContactRegion(), Contacts(), Slip(),
                    ContactRegion(centroid=unknown, orientation=NAN, outlines=[Polygon(points=[Point32(x=1e-3)])]),
                    Contacts(contacts=[Contact(position=unknown, depth=NAN, position_covariance=np.full(9, NAN))]),
                    Slip(x=floats(NAN), y=floats(0), vx=floats(1), vy=floats(NAN), rotation_center=unknown),
                    WrenchStamped(wrench=Wrench(force=Vector3(x=NAN, y=1.0, z=-1e3)))):
        check_message(message)


@pytest.mark.parametrize('changes, reason', [
    ({'u': floats(1)}, 'u has 1 entries, id has 2'), ({'dv': floats()}, 'dv has 0'), ({'x': floats(1)}, 'x, y, z have 1, 2, 2'),
    ({'id': array('I', [1, 6])}, 'beyond the grid of 6'), ({'id': array('I', [1, 2**32 - 1])}, 'beyond the grid'),
    ({'id': array('I', [5, 5])}, 'twice'), ({'u': floats(1, NAN)}, 'u holds nan'), ({'v': floats(1, np.inf)}, 'v holds inf'),
    ({'du': floats(1, 1e30)}, r'du holds 1e\+30'), ({'area': floats(1, 0)}, 'not above 0'),
    ({'area': floats(1, -np.inf)}, 'area holds -inf'),
    ({'z': floats(1, 1e9)}, r'z holds 1e\+09')])
def test_invalid_dots_are_refused(changes, reason):
    with pytest.raises(BadFrame, match=reason):
        check_message(dots(**changes))


def test_a_pattern_without_a_grid_has_any_indices():
    check_message(dots(rows=0, columns=0, id=array('I', [7, 2**32 - 1])))


@pytest.mark.parametrize('message, reason', [
    (ContactRegion(dot_id=array('I', [1]), dot_state=array('B', [3])), '1 dots with 1 states'),
    (ContactRegion(dot_id=array('I', [1, 2]), dot_state=array('B', [1])), '2 dots with 1 states'),
    (ContactRegion(area=1e9), 'area holds'), (ContactRegion(normal=Vector3(z=np.inf)), 'normal holds inf'),
    (ContactRegion(holes=[Polygon(points=[Point32(x=NAN)])]), 'holes holds nan'),
    (ContactRegion(motion_interval=np.inf), 'motion_interval'),
    (Contacts(contacts=[Contact(), Contact(position=Point(y=-np.inf))]), 'position holds -inf'),
    (Contacts(contacts=[Contact(position_covariance=np.full(9, 1e300))]), 'position_covariance holds'),
    (Slip(state=3), 'state 3 is not one of'), (Slip(x=floats(1)), 'y has 0 entries, x has 1'),
    (Slip(slipping_fraction=np.inf), 'slipping_fraction'),
    (WrenchStamped(wrench=Wrench(torque=Vector3(x=np.inf))), 'wrench holds inf')])
def test_invalid_results_are_refused(message, reason):
    with pytest.raises(BadFrame, match=reason):
        check_message(message)


@pytest.mark.parametrize('sec, nanosec', [(-1, 0), (-2**31, 0), (0, 10**9), (2**31 - 1, 2**32 - 1)])
def test_invalid_stamps_are_refused(sec, nanosec):
    message = Image()
    message.header.stamp.sec, message.header.stamp.nanosec = sec, nanosec
    with pytest.raises(BadFrame, match=f'stamp {sec} s'):
        check_message(message)


NAMES = ['x', 'y', 'z', 'normal_x', 'normal_y', 'normal_z', 'displacement_x', 'displacement_y', 'displacement_z', 'force_x', 'force_y',
         'force_z', 'normal_force', 'state']


def some_points(shape=(2, 3)):
    rng, count = np.random.default_rng(4), shape[0] * shape[1]
    vectors = [rng.normal(size=(count, 3)) for _ in range(4)]
    vectors[3][0] = np.nan
    return SurfacePoints(shape, *vectors, rng.normal(size=count), np.array([0, 1, 2, UNKNOWN, 0, 1][:count], np.uint8))


def columns(points):
    """Field name -> values, as the cloud should hold them."""
    vectors = np.hstack([points.xyz, points.normal, points.displacement, points.force])
    return dict(zip(NAMES, (*vectors.T.astype(np.float32), points.normal_force.astype(np.float32), points.state)))


def read(message):
    """Field name -> values, by what the message itself says of its bytes."""
    kinds = {PointField.FLOAT32: np.dtype('<f4'), PointField.UINT8: np.dtype('u1')}
    data = np.frombuffer(message.data, np.uint8).reshape(-1, message.point_step)
    return {f.name: data[:, f.offset:f.offset + kinds[f.datatype].itemsize].copy().view(kinds[f.datatype]).ravel() for f in message.fields}


def test_every_field_comes_back():
    points, header = some_points(), Header(frame_id='pad')
    message = points_to_message(points, header)
    assert message.header == header and [f.name for f in message.fields] == NAMES
    for name, values in read(message).items():
        np.testing.assert_array_equal(values, columns(points)[name], name)


def test_rows_and_columns_are_the_grids():
    message = points_to_message(some_points(), Header())
    assert (message.height, message.width, message.row_step) == (2, 3, 3 * message.point_step)
    assert len(message.data) == 2 * message.row_step and message.is_dense and not message.is_bigendian


def test_a_cloud_with_a_point_that_has_no_place_is_not_dense():
    points = some_points()
    points.xyz[4] = np.nan
    assert not points_to_message(points, Header()).is_dense


def test_sensor_msgs_py_reads_it():
    reader = pytest.importorskip('sensor_msgs_py.point_cloud2')
    points = some_points()
    message = points_to_message(points, Header())
    found = reader.read_points(message.message)
    for name in NAMES:
        np.testing.assert_array_equal(found[name].ravel(), columns(points)[name], name)
    np.testing.assert_array_equal(reader.read_points_numpy(message.message, ['x', 'y', 'z']), points.xyz.astype(np.float32))
