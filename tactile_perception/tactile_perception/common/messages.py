# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Conversions between messages and arrays, for live nodes and offline tools.

Readers of recorded results and of ground truth, which has the same types, convert back. The checks of ..core.messages raise BadFrame.
"""
from __future__ import annotations

from array import array
from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np
import yaml
from geometry_msgs.msg import Point, Transform, TransformStamped, Vector3, WrenchStamped
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from tactile_driver.nodes.messages.conversions import bytes_of, header_of, polygon
from tactile_msgs.msg import Contact, ContactRegion, Contacts, DotTracks, Slip

from ..core.messages import check_numbers, dot_numbers
from . import dots
from .estimates import ContactEstimate, ContactRegionEstimate, SlipEstimate
from .surface_points import SurfacePoints


def _floats(values: np.ndarray) -> array:
    return array('f', values.astype(np.float32).tobytes())


def tracks_to_message(tracks: dots.DotTracks, header) -> DotTracks:
    """Make the message of tracked dots.

    Parameters
    ----------
    tracks : common.dots.DotTracks
        Dots of one image.
    header : Header
        Header of the raw message, whose stamp the result keeps.

    Returns
    -------
    DotTracks
    """
    message = DotTracks(header=header, rows=tracks.rows, columns=tracks.columns)
    message.id = array('I', np.ascontiguousarray(tracks.id, np.uint32).tobytes())
    message.u, message.v = map(_floats, tracks.uv.T)
    message.du, message.dv = map(_floats, tracks.duv.T)
    message.area = _floats(tracks.area)
    if tracks.xyz is not None:
        message.x, message.y, message.z = map(_floats, tracks.xyz.T)
    return message


def tracks_from_message(message: DotTracks) -> dots.DotTracks:
    """Tracked dots of a message.

    Parameters
    ----------
    message : DotTracks
        Message of a tracker or of a recording.

    Returns
    -------
    common.dots.DotTracks
        Its `sigma`, which the message does not carry, is NaN.

    Raises
    ------
    BadFrame
        As `dot_numbers` does.
    """
    ids, numbers = dot_numbers(message)
    uv, duv, xyz = (np.ascontiguousarray(numbers[part].T) for part in (slice(0, 2), slice(2, 4), slice(5, 8)))
    return dots.DotTracks(message.rows, message.columns, ids, uv, numbers[4], np.full(len(ids), np.nan), duv,
                          xyz if xyz.shape[1] else None)


def region_to_message(estimate: ContactRegionEstimate, header) -> ContactRegion:
    """Make the message of a contact region.

    Parameters
    ----------
    estimate : ContactRegionEstimate
        Region in the sensor frame.
    header : Header
        Header of the raw message, whose stamp the result keeps.

    Returns
    -------
    ContactRegion
    """
    message = ContactRegion(header=header)
    message.dot_id = array('I', np.ascontiguousarray(estimate.dot_id, np.uint32).tobytes())
    message.dot_state = array('B', np.ascontiguousarray(estimate.dot_state, np.uint8).tobytes())
    message.dot_confidence = _floats(estimate.dot_confidence)
    message.outlines = [polygon(points) for points in estimate.outlines]
    message.holes = [polygon(points) for points in estimate.holes]
    for name in ('area', 'orientation', 'major_axis', 'minor_axis', 'motion_interval'):
        setattr(message, name, float(getattr(estimate, name)))
    _set_xyz(message.centroid, estimate.centroid)
    _set_xyz(message.normal, estimate.normal)
    _set_transform(message.motion, estimate.motion_translation, estimate.motion_rotation)
    message.motion_covariance = estimate.motion_covariance.ravel()
    _set_transform(message.pose, estimate.pose_translation, estimate.pose_rotation)
    return message


def _set_xyz(target: Point | Vector3, values: np.ndarray) -> None:
    """Set a point or vector within a message: a new one would be made after the message has made its own."""
    target.x, target.y, target.z = np.asarray(values, float).tolist()


def _set_transform(target: Transform, translation: np.ndarray, rotation: np.ndarray) -> None:
    _set_xyz(target.translation, translation)
    turn = target.rotation
    turn.x, turn.y, turn.z, turn.w = np.asarray(rotation, float).tolist()


def contacts_to_message(estimates: list[ContactEstimate], header) -> Contacts:
    """Make the message of contacts.

    Parameters
    ----------
    estimates : list of ContactEstimate
        Empty if nothing touches.
    header : Header
        Header of the raw message, whose stamp the result keeps.

    Returns
    -------
    Contacts
    """
    return Contacts(header=header, contacts=[_contact_message(estimate) for estimate in estimates])


def _contact_message(estimate: ContactEstimate) -> Contact:
    message = Contact(id=estimate.id, depth=float(estimate.depth), force=float(estimate.force), flags=estimate.flags,
                      position_covariance=np.asarray(estimate.position_covariance, float).ravel())
    _set_xyz(message.position, estimate.position)
    _set_xyz(message.normal, estimate.normal)
    return message


def wrench_to_message(wrench: np.ndarray, header) -> WrenchStamped:
    """Make the message of a wrench.

    Parameters
    ----------
    wrench : ndarray, shape (6,)
        Force in N and torque in N m of the object on the sensor, at the origin of the sensor frame.
    header : Header
        Header of the raw message, whose stamp the result keeps.

    Returns
    -------
    WrenchStamped
    """
    message = WrenchStamped(header=header)
    _set_xyz(message.wrench.force, wrench[:3])
    _set_xyz(message.wrench.torque, wrench[3:])
    return message


def slip_to_message(estimate: SlipEstimate, header) -> Slip:
    """Make the message of slip.

    Parameters
    ----------
    estimate : SlipEstimate
        Slip in the sensor frame.
    header : Header
        Header of the raw message, whose stamp the result keeps.

    Returns
    -------
    Slip
    """
    message = Slip(header=header, state=estimate.state)
    message.slipping_fraction, message.confidence = float(estimate.slipping_fraction), float(estimate.confidence)
    _set_xyz(message.velocity.linear, estimate.linear)
    _set_xyz(message.velocity.angular, estimate.angular)
    message.velocity_covariance = estimate.velocity_covariance.ravel()
    _set_xyz(message.rotation_center, estimate.rotation_center)
    message.x, message.y, message.vx, message.vy = map(_floats, (estimate.x, estimate.y, estimate.vx, estimate.vy))
    return message


POINTS = {'points': PointCloud2}
_VECTORS = 'xyz', 'normal', 'displacement', 'force'  # of a point, in the order of their fields
_FLOATS = (*(f'{name}{axis}' for name in ('', 'normal_', 'displacement_', 'force_') for axis in 'xyz'), 'normal_force')
_FIELDS = [*(PointField(name=name, offset=4 * k, datatype=PointField.FLOAT32, count=1) for k, name in enumerate(_FLOATS)),
           PointField(name='state', offset=4 * len(_FLOATS), datatype=PointField.UINT8, count=1)]
_VECTOR = np.dtype('V12')  # three floats, which NumPy copies as one
_POINT = np.dtype([*((name, _VECTOR) for name in _VECTORS), ('normal_force', '<f4'), ('state', 'u1'), ('filled', 'V3')])


def points_to_message(points: SurfacePoints, header) -> PointCloud2:
    """Make the point cloud of a sensor's surface.

    Parameters
    ----------
    points : SurfacePoints
        Points in the order of their numbers.
    header : Header
        Header of the raw message, whose stamp the result keeps.

    Returns
    -------
    PointCloud2
        As many rows and columns as the grid.
    """
    rows, columns = points.shape
    packed = np.zeros(rows * columns, _POINT)
    for name in _VECTORS:
        packed[name] = np.ascontiguousarray(getattr(points, name), '<f4').view(_VECTOR)[:, 0]
    packed['normal_force'], packed['state'] = points.normal_force, points.state
    message = PointCloud2(header=header, height=rows, width=columns, fields=_FIELDS.copy(), is_bigendian=False, point_step=_POINT.itemsize,
                          row_step=_POINT.itemsize * columns, is_dense=bool(np.isfinite(points.xyz).all()))
    message.data = bytes_of(packed)
    return message


#: Topic -> type of the estimates of all sensors.
RESULTS = {'contact_region': ContactRegion, 'contacts': Contacts, 'slip': Slip, 'wrench': WrenchStamped}
#: topic -> type of what sensors give that do not estimate slip
WITHOUT_SLIP = {topic: kind for topic, kind in (RESULTS | POINTS).items() if topic != 'slip'}
#: topic -> (attribute of an estimator's result, its conversion)
_RESULTS = {
    'contact_region': ('region', region_to_message),
    'contacts': ('contacts', contacts_to_message),
    'slip': ('slip', slip_to_message),
    'wrench': ('wrench', wrench_to_message),
    'points': ('points', lambda make, header: points_to_message(make(), header)),
}


def results_to_messages(result, header, topics: Collection[str]) -> dict[str, list]:
    """Topic -> messages under the raw message's header, of the requested parts of an estimator's result."""
    return {topic: [to_message(getattr(result, part), header)] for topic, (part, to_message) in _RESULTS.items() if topic in topics}


def description_messages(stamp_ns: int, sensor_type: str, frame_id: str, about: Mapping,
                         transforms: Sequence[TransformStamped]) -> Iterator[tuple[int, str, object]]:
    """(stamp, ns, topic, message) of the description, as a driver publishes it, and of /tf_static.

    about: source and what else is known, as plain values; transforms: of the sensor's own frames.
    """
    text = yaml.safe_dump({'sensor_type': sensor_type, 'frame_id': frame_id, **about}, sort_keys=False)
    yield stamp_ns, 'description', String(data=text)
    for transform in transforms:
        transform.header.stamp = header_of(stamp_ns, frame_id).stamp
    yield stamp_ns, '/tf_static', TFMessage(transforms=list(transforms))


def contacts_from_message(message: Contacts) -> list[ContactEstimate]:
    """Contacts of a message.

    Parameters
    ----------
    message : Contacts
        Message of a node or of a recording.

    Returns
    -------
    list of ContactEstimate
        Their `members`, which the message does not carry, are empty.

    Raises
    ------
    BadFrame
        As `check_numbers` does.
    """
    check_numbers(message)
    return [ContactEstimate(c.id, _xyz(c.position), _xyz(c.normal), c.depth, c.force, np.array(c.position_covariance).reshape(3, 3),
                            c.flags, np.zeros(0, bool)) for c in message.contacts]


def region_from_message(message: ContactRegion) -> ContactRegionEstimate:
    """Contact region of a message.

    Parameters
    ----------
    message : ContactRegion
        Message of a node or of a recording.

    Returns
    -------
    ContactRegionEstimate
        Unknown numbers are NaN.

    Raises
    ------
    BadFrame
        As `check_numbers` does.
    """
    check_numbers(message)
    ids, states = np.array(message.dot_id, np.int64), np.array(message.dot_state, np.uint8)
    return ContactRegionEstimate(ids, states, [_loop(loop) for loop in message.outlines], [_loop(loop) for loop in message.holes],
                                 message.area, _xyz(message.centroid), _xyz(message.normal), message.orientation, message.major_axis,
                                 message.minor_axis, *_motion(message.motion), message.motion_interval,
                                 np.array(message.motion_covariance).reshape(6, 6), *_motion(message.pose),
                                 np.array(message.dot_confidence, float))


def slip_from_message(message: Slip) -> SlipEstimate:
    """Slip of a message.

    Parameters
    ----------
    message : Slip
        Message of a node or of a recording.

    Returns
    -------
    SlipEstimate
        Unknown numbers are NaN.

    Raises
    ------
    BadFrame
        As `check_numbers` does.
    """
    check_numbers(message)
    positions = (np.array(getattr(message, name), float) for name in ('x', 'y', 'vx', 'vy'))
    return SlipEstimate(message.state, message.slipping_fraction, _xyz(message.velocity.linear), _xyz(message.velocity.angular),
                        np.array(message.velocity_covariance).reshape(6, 6), _xyz(message.rotation_center), *positions,
                        message.confidence)


def wrench_from_message(message: WrenchStamped) -> np.ndarray:
    """Wrench of a message.

    Parameters
    ----------
    message : WrenchStamped
        Message of a node or of a recording.

    Returns
    -------
    ndarray, shape (6,)
        Force in N and torque in N m.

    Raises
    ------
    BadFrame
        As `check_numbers` does.
    """
    check_numbers(message)
    return np.concatenate([_xyz(message.wrench.force), _xyz(message.wrench.torque)])


def _xyz(point) -> np.ndarray:
    return np.array([point.x, point.y, point.z])


def _motion(transform) -> tuple[np.ndarray, np.ndarray]:
    turn = transform.rotation
    return _xyz(transform.translation), np.array([turn.x, turn.y, turn.z, turn.w])


def _loop(polygon) -> np.ndarray:
    return np.array([(p.x, p.y, p.z) for p in polygon.points], float).reshape(-1, 3)
