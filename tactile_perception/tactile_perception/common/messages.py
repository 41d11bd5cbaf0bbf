# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Conversions between messages and arrays, for live nodes and offline tools.

Readers of recorded results and of ground truth, which has the same types, convert back. The checks of ..core.messages raise BadFrame.
"""
from __future__ import annotations

import struct
from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np
import yaml
from geometry_msgs.msg import TransformStamped, WrenchStamped
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from tactile_driver.nodes.messages.conversions import header_of
from tactile_driver.recordings.written_message import WrittenMessage
from tactile_msgs.msg import ContactRegion, Contacts, DotTracks, Slip

from .._core.common import pack_points
from ..core.messages import check_numbers, dot_numbers
from . import dots
from .estimates import ContactEstimate, ContactRegionEstimate, SlipEstimate
from .surface_points import SurfacePoints


def tracks_to_message(tracks: dots.DotTracks, header) -> WrittenMessage:
    """Make the message of tracked dots.

    Parameters
    ----------
    tracks : common.dots.DotTracks
        Dots of one image.
    header : Header
        Header of the raw message, whose stamp the result keeps.

    Returns
    -------
    WrittenMessage
        Of DotTracks.
    """
    message = WrittenMessage(DotTracks, header)
    message.add(np.uint16, (tracks.rows, tracks.columns))
    message.add_sequence(np.uint32, tracks.id)
    xyz = np.empty((0, 3)) if tracks.xyz is None else tracks.xyz
    for values in (*tracks.uv.T, tracks.area, *tracks.duv.T, *xyz.T):
        message.add_sequence(np.float32, values)
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


def region_to_message(estimate: ContactRegionEstimate, header) -> WrittenMessage:
    """Make the message of a contact region.

    Parameters
    ----------
    estimate : ContactRegionEstimate
        Region in the sensor frame.
    header : Header
        Header of the raw message, whose stamp the result keeps.

    Returns
    -------
    WrittenMessage
        Of ContactRegion.
    """
    message = WrittenMessage(ContactRegion, header)
    message.add_sequence(np.uint32, estimate.dot_id)
    message.add_sequence(np.uint8, estimate.dot_state)
    for loops in (estimate.outlines, estimate.holes):
        message.add_count(len(loops))
        for loop in loops:
            message.add_sequence(np.float32, loop)
    message.add(np.float64, np.concatenate([
        [estimate.area], estimate.centroid, estimate.normal, [estimate.orientation, estimate.major_axis, estimate.minor_axis],
        estimate.motion_translation, estimate.motion_rotation, [estimate.motion_interval], estimate.motion_covariance.ravel(),
        estimate.pose_translation, estimate.pose_rotation]))
    message.add_sequence(np.float32, estimate.dot_confidence)
    return message


def contacts_to_message(estimates: list[ContactEstimate], header) -> WrittenMessage:
    """Make the message of contacts.

    Parameters
    ----------
    estimates : list of ContactEstimate
        Empty if nothing touches.
    header : Header
        Header of the raw message, whose stamp the result keeps.

    Returns
    -------
    WrittenMessage
        Of Contacts.
    """
    message = WrittenMessage(Contacts, header)
    message.add_count(len(estimates))
    for estimate in estimates:
        message.add_count(estimate.id)
        message.add(np.float64, np.concatenate([estimate.position, estimate.normal, [estimate.depth, estimate.force],
                                                np.ravel(estimate.position_covariance)]))
        message.add(np.uint8, estimate.flags)
    return message


def wrench_to_message(wrench: np.ndarray, header) -> WrittenMessage:
    """Make the message of a wrench.

    Parameters
    ----------
    wrench : ndarray, shape (6,)
        Force in N and torque in N m of the object on the sensor, at the origin of the sensor frame.
    header : Header
        Header of the raw message, whose stamp the result keeps.

    Returns
    -------
    WrittenMessage
        Of WrenchStamped.
    """
    message = WrittenMessage(WrenchStamped, header)
    message.add(np.float64, wrench)
    return message


def slip_to_message(estimate: SlipEstimate, header) -> WrittenMessage:
    """Make the message of slip.

    Parameters
    ----------
    estimate : SlipEstimate
        Slip in the sensor frame.
    header : Header
        Header of the raw message, whose stamp the result keeps.

    Returns
    -------
    WrittenMessage
        Of Slip.
    """
    message = WrittenMessage(Slip, header)
    message.add(np.uint8, estimate.state)
    message.add(np.float32, estimate.slipping_fraction)
    message.add(np.float64, np.concatenate([estimate.linear, estimate.angular, estimate.velocity_covariance.ravel(),
                                            estimate.rotation_center]))
    for values in (estimate.x, estimate.y, estimate.vx, estimate.vy):
        message.add_sequence(np.float32, values)
    message.add(np.float32, estimate.confidence)
    return message


POINTS = {'points': PointCloud2}
_FLOATS = (*(f'{name}{axis}' for name in ('', 'normal_', 'displacement_', 'force_') for axis in 'xyz'), 'normal_force')
_POINT_BYTES = 4 * len(_FLOATS) + 4  # with those of the state


def _written_fields() -> bytes:
    """Write the sequence of sensor_msgs/PointField of a point as CDR."""
    data = struct.pack('<I', len(_FLOATS) + 1)
    for k, name in enumerate((*_FLOATS, 'state')):
        text = name.encode() + b'\0'
        data += struct.pack(f'<I{len(text)}s', len(text), text)
        data += bytes(-len(data) % 4) + struct.pack('<IBxxxI', 4 * k, PointField.UINT8 if name == 'state' else PointField.FLOAT32, 1)
    return data


_FIELDS = _written_fields()


def points_to_message(points: SurfacePoints, header) -> WrittenMessage:
    """Make the point cloud of a sensor's surface.

    Parameters
    ----------
    points : SurfacePoints
        Points in the order of their numbers.
    header : Header
        Header of the raw message, whose stamp the result keeps.

    Returns
    -------
    WrittenMessage
        Of PointCloud2, with as many rows and columns as the grid.
    """
    packed = pack_points(*(np.asarray(numbers, float) for numbers in (points.xyz, points.normal, points.displacement, points.force,
                                                                      points.normal_force)), np.asarray(points.state, np.uint8))
    message = WrittenMessage(PointCloud2, header)
    message.add(np.uint32, points.shape)
    message.add_bytes(_FIELDS)
    message.add(np.bool_, False)  # not big-endian
    message.add(np.uint32, (_POINT_BYTES, _POINT_BYTES * points.shape[1]))
    message.add_sequence(np.uint8, packed.view(np.uint8).ravel())
    message.add(np.bool_, np.isfinite(points.xyz).all())
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
