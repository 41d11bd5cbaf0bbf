# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Conversions between messages and arrays; live nodes and offline tools use the same functions. Readers of recorded results and of ground
truth, which has the same types, convert back. ROS passes any number and arrays of any lengths: checks raise BadFrame, which says what is
wrong and where. A message that passed has parallel arrays of equal lengths, and numbers that are finite, or NaN where not known."""
from __future__ import annotations

from array import array
from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np
import yaml
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Twist, WrenchStamped
from sensor_msgs.msg import CameraInfo, PointCloud2, PointField
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from tactile_driver.nodes.messages.conversions import bytes_of, header_of, point, polygon, stamp_ns_of, vector
from tactile_msgs.msg import Contact, ContactRegion, Contacts, DotTracks, Slip

from ...common import dots
from ...common.estimates import ContactEstimate, ContactRegionEstimate, SlipEstimate
from ...common.surface_points import SurfacePoints
from ...errors import BadFrame

# Limits beyond every sensor; products of numbers within them do not overflow. Chosen.
_FARTHEST_PX = 1e6  # wider than any image
_LARGEST_PX2 = _FARTHEST_PX**2
_FARTHEST_M = 100.0  # from the origin, which is on the sensor
_LARGEST = 1e9  # of forces, velocities, covariances in SI units
_IN_IMAGE, _POSITION_FIELDS = ('u', 'v', 'du', 'dv', 'area'), ('x', 'y', 'z')
_DOT_LIMITS = np.array([_FARTHEST_PX] * 4 + [_LARGEST_PX2] + [_FARTHEST_M] * 3)


def dot_numbers(message: DotTracks) -> tuple[np.ndarray, np.ndarray]:
    """Indices (N,) int64 of dots, and (8, N) float64 u, v, du, dv, area, x, y, z; (5, N) without positions.

    Raises BadFrame unless arrays have equal lengths, indices are unique and on the grid, and positions within an image.
    """
    count = len(message.id)
    _check_lengths('dots', message, _IN_IMAGE, count)
    positions = [len(getattr(message, name)) for name in _POSITION_FIELDS]
    if set(positions) not in ({0}, {count}):
        raise BadFrame(f'dots: x, y, z have {", ".join(map(str, positions))} entries, id has {count}')
    ids = np.asarray(message.id, np.int64)
    _check_ids('dots', ids, message.rows * message.columns)
    names = (*_IN_IMAGE, *_POSITION_FIELDS) if count and positions[0] else _IN_IMAGE
    numbers = np.array([getattr(message, name) for name in names], float)
    limits = _DOT_LIMITS[:len(names)]
    if (np.abs(numbers) > limits[:, None]).any() or np.isnan(numbers[:2]).any():
        for name, values, limit in zip(names, numbers, limits):
            _check_values(f'dots: {name}', values, limit, known=name in 'uv')
    if (numbers[_IN_IMAGE.index('area')] <= 0).any():
        raise BadFrame('dots: an area is not above 0; publish NaN where it is not known')
    return ids, numbers


#: Type of a message -> name of a field or of one within it, and the largest magnitude of its numbers.
_LIMITS = {
    ContactRegion: {**dict.fromkeys(('centroid', 'normal', 'motion', 'pose', 'area', 'dot_confidence', 'orientation', 'major_axis',
                                     'minor_axis'), _FARTHEST_M), 'motion_interval': _LARGEST},
    Contact: {'position': _FARTHEST_M, **dict.fromkeys(('normal', 'depth', 'force', 'position_covariance'), _LARGEST)},
    Slip: dict.fromkeys(('x', 'y', 'vx', 'vy', 'slipping_fraction', 'confidence', 'rotation_center', 'velocity'), _LARGEST),
    WrenchStamped: {'wrench': _LARGEST},
}


def check_message(message) -> None:
    """Check the stamp of any message, and the numbers of a result; images are checked by image_to_array. Raises BadFrame."""
    stamp_ns_of(message.header)
    check_numbers(message)


def check_numbers(message) -> None:
    """Check the numbers of dots or of a result: arrays that belong together are equally long, states are defined, numbers finite or NaN.
    Raises BadFrame."""
    if isinstance(message, DotTracks):
        dot_numbers(message)
    elif isinstance(message, ContactRegion):
        count, states = len(message.dot_id), np.asarray(message.dot_state, np.int64)
        if count != len(states) or (states > ContactRegion.SLIPPING).any():
            raise BadFrame(f'contact_region: {count} dots with {len(states)} states of 0 to {ContactRegion.SLIPPING}; both arrays must '
                           'have the same length')
        if len(message.dot_confidence) not in (0, count):
            raise BadFrame(f'contact_region: {len(message.dot_confidence)} confidences of {count} dots; one each, or none at all')
        for name in ('outlines', 'holes'):
            for loop in getattr(message, name):
                _check_values(f'contact_region: {name}', [c for p in loop.points for c in (p.x, p.y, p.z)], _FARTHEST_M, known=True)
    elif isinstance(message, Slip):
        if message.state > Slip.GROSS:
            raise BadFrame(f'slip: state {message.state} is none of 0 to {Slip.GROSS}')
        _check_lengths('slip', message, ('y', 'vx', 'vy'), len(message.x), 'x')
    for part in message.contacts if isinstance(message, Contacts) else (message,):
        for name, limit in _LIMITS.get(type(part), {}).items():
            _check_values(f'{_TOPICS[type(part)]}: {name}', _numbers(getattr(part, name)), limit)


_TOPICS = {ContactRegion: 'contact_region', Contact: 'contacts', Slip: 'slip', WrenchStamped: 'wrench'}


def _numbers(value) -> Sequence[float]:
    """All numbers of a field."""
    if hasattr(value, 'get_fields_and_field_types'):
        return [number for name in value.get_fields_and_field_types() for number in _numbers(getattr(value, name))]
    return np.atleast_1d(value)


def _check_lengths(topic: str, message, names: Sequence[str], count: int, like: str = 'id') -> None:
    for name in names:
        if len(getattr(message, name)) != count:
            raise BadFrame(f'{topic}: {name} has {len(getattr(message, name))} entries, {like} has {count}; the publisher of {topic} '
                           'must fill both with as many')


def _check_ids(topic: str, ids: np.ndarray, count: int) -> None:
    """Raise BadFrame for an index that appears twice or is not below count (0: no grid)."""
    if count and len(ids) and ids.max() >= count:
        raise BadFrame(f'{topic}: index {ids.max()} is beyond the grid of {count}; rows and columns of tracker and publisher differ')
    if not (ids[1:] > ids[:-1]).all() and len(np.unique(ids)) != len(ids):
        raise BadFrame(f'{topic}: an index appears twice in id; each dot has its own')


def _check_values(what: str, values, limit: float, known: bool = False) -> None:
    """Raise BadFrame for a magnitude above limit, and for NaN where the value must be known."""
    values = np.asarray(values, float)
    bad = ~(np.abs(values) <= limit)
    if not known and bad.any():
        bad &= ~np.isnan(values)
    if bad.any():
        raise BadFrame(f'{what} holds {values[bad][0]:g}; allowed are magnitudes up to {limit:g}{"" if known else ", and NaN: not known"}')


#: Limits of plumb_bob numbers, beyond any lens: so that the algorithms do not overflow.
_MIN_FOCAL_LENGTH_PX, _MAX_DISTORTION = 1.0, 1e6
_NO_DISTORTION = 1e-12  # a smaller coefficient counts as 0: it bends no ray, and the inversion would divide by it


def camera_matrices(message: CameraInfo) -> tuple[np.ndarray, np.ndarray] | None:
    """K (3, 3) and distortion (5,) of a camera_info; None where the camera is not calibrated (K of zeros). Raises BadFrame for another
    distortion model, and for numbers that fit no camera.
    """
    matrix = np.array(message.k, float).reshape(3, 3)
    if not matrix.any():
        return None
    if message.distortion_model not in ('plumb_bob', ''):
        raise BadFrame(f'camera_info: distortion model {message.distortion_model[:40]!r} is not supported; use plumb_bob')
    if len(message.d) > 5:
        raise BadFrame(f'camera_info: {len(message.d)} distortion coefficients; plumb_bob has 5')
    _check_camera(matrix, np.asarray(message.d, float))
    distortion = np.zeros(5)
    distortion[:len(message.d)] = message.d
    distortion[np.abs(distortion) < _NO_DISTORTION] = 0.0
    return matrix, distortion


def _check_camera(matrix: np.ndarray, distortion: np.ndarray) -> None:
    """Raise BadFrame unless K (3, 3) and the plumb_bob coefficients are finite and plausible."""
    focus, middle = matrix[[0, 1], [0, 1]], matrix[:2, 2]
    rest = matrix[[0, 1, 2, 2, 2], [1, 0, 0, 1, 2]]
    if not ((focus >= _MIN_FOCAL_LENGTH_PX) & (focus <= _FARTHEST_PX)).all() or not (np.abs(middle) <= _FARTHEST_PX).all() \
            or rest.tolist() != [0, 0, 0, 0, 1]:
        raise BadFrame(f'camera_info: k {matrix.ravel().tolist()} is not of a camera, [fx 0 cx, 0 fy cy, 0 0 1] in px with fx and fy from '
                       f'{_MIN_FOCAL_LENGTH_PX:g} px on; calibrate the camera, or publish zeros where it is not calibrated')
    if not (np.abs(distortion) <= _MAX_DISTORTION).all():
        raise BadFrame(f'camera_info: distortion {distortion.tolist()} is beyond any lens; calibrate the camera')


def stamp_seconds(header) -> float:
    """A header's stamp, s. Raises BadFrame for an invalid stamp."""
    stamp_ns_of(header)
    return header.stamp.sec + 1e-9 * header.stamp.nanosec


def _floats(values: np.ndarray) -> array:
    return array('f', values.astype(np.float32).tobytes())


def tracks_to_message(tracks: dots.DotTracks, header) -> DotTracks:
    """DotTracks under the image's header."""
    message = DotTracks(header=header, rows=tracks.rows, columns=tracks.columns)
    message.id = array('I', np.ascontiguousarray(tracks.id, np.uint32).tobytes())
    message.u, message.v = map(_floats, tracks.uv.T)
    message.du, message.dv = map(_floats, tracks.duv.T)
    message.area = _floats(tracks.area)
    if tracks.xyz is not None:
        message.x, message.y, message.z = map(_floats, tracks.xyz.T)
    return message


def tracks_from_message(message: DotTracks) -> dots.DotTracks:
    """DotTracks of a message; sigma, which the message does not carry, is NaN. Raises BadFrame for invalid ones (dot_numbers)."""
    ids, numbers = dot_numbers(message)
    uv, duv, xyz = (np.ascontiguousarray(numbers[part].T) for part in (slice(0, 2), slice(2, 4), slice(5, 8)))
    return dots.DotTracks(message.rows, message.columns, ids, uv, numbers[4], np.full(len(ids), np.nan), duv,
                          xyz if xyz.shape[1] else None)


def region_to_message(estimate: ContactRegionEstimate, header) -> ContactRegion:
    """ContactRegion under the image's header."""
    return ContactRegion(
        header=header,
        dot_id=array('I', np.ascontiguousarray(estimate.dot_id, np.uint32).tobytes()),
        dot_state=array('B', np.ascontiguousarray(estimate.dot_state, np.uint8).tobytes()),
        outlines=[polygon(points) for points in estimate.outlines],
        holes=[polygon(points) for points in estimate.holes],
        area=float(estimate.area),
        centroid=point(estimate.centroid),
        normal=vector(estimate.normal),
        orientation=float(estimate.orientation),
        major_axis=float(estimate.major_axis),
        minor_axis=float(estimate.minor_axis),
        motion=_transform(estimate.motion_translation, estimate.motion_rotation),
        motion_interval=float(estimate.motion_interval),
        pose=_transform(estimate.pose_translation, estimate.pose_rotation),
        dot_confidence=_floats(estimate.dot_confidence),
    )


def _transform(translation: np.ndarray, rotation: np.ndarray) -> Transform:
    x, y, z, w = map(float, rotation)
    return Transform(translation=vector(translation), rotation=Quaternion(x=x, y=y, z=z, w=w))


def contacts_to_message(estimates: list[ContactEstimate], header) -> Contacts:
    """Contacts under the image's header."""
    return Contacts(header=header, contacts=[
        Contact(id=e.id, position=point(e.position), normal=vector(e.normal), depth=float(e.depth), force=float(e.force),
                position_covariance=np.asarray(e.position_covariance, float).ravel(), flags=e.flags) for e in estimates])


def wrench_to_message(wrench: np.ndarray, header) -> WrenchStamped:
    """A wrench (6,), N and N m, of the object on the sensor at the frame's origin."""
    message = WrenchStamped(header=header)
    message.wrench.force, message.wrench.torque = vector(wrench[:3]), vector(wrench[3:])
    return message


def slip_to_message(estimate: SlipEstimate, header) -> Slip:
    """Slip under the image's header."""
    return Slip(
        header=header,
        state=estimate.state,
        slipping_fraction=float(estimate.slipping_fraction),
        velocity=Twist(linear=vector(estimate.linear), angular=vector(estimate.angular)),
        rotation_center=point(estimate.rotation_center),
        x=_floats(estimate.x),
        y=_floats(estimate.y),
        vx=_floats(estimate.vx),
        vy=_floats(estimate.vy),
        confidence=float(estimate.confidence),
    )


POINTS = {'points': PointCloud2}
#: Fields in their order: of a vector three, of a number one.
_VECTORS = {'xyz': ('x', 'y', 'z'), 'normal': ('normal_x', 'normal_y', 'normal_z'),
            'displacement': ('displacement_x', 'displacement_y', 'displacement_z'), 'force': ('force_x', 'force_y', 'force_z')}
_FLOATS = (*(name for names in _VECTORS.values() for name in names), 'normal_force')
_STEP = 56  # bytes a point: its floats and the state, filled up to a multiple of four
_POINT = np.dtype({'names': [*_FLOATS, 'state'], 'formats': ['<f4'] * len(_FLOATS) + ['u1'],
                   'offsets': [4 * k for k in range(len(_FLOATS) + 1)], 'itemsize': _STEP})


def points_to_message(points: SurfacePoints, header) -> PointCloud2:
    """The cloud under the raw message's header: as many rows and columns as the grid, a point where its number says."""
    rows, columns = points.shape
    packed = np.zeros(rows * columns, _POINT)
    for whole, names in _VECTORS.items():
        for name, values in zip(names, getattr(points, whole).T):
            packed[name] = values
    packed['normal_force'], packed['state'] = points.normal_force, points.state
    fields = [PointField(name=name, offset=offset, datatype=PointField.UINT8 if kind == 'u1' else PointField.FLOAT32, count=1)
              for name, (kind, offset) in _POINT.fields.items()]
    message = PointCloud2(header=header, height=rows, width=columns, fields=fields, is_bigendian=False, point_step=_STEP,
                          row_step=_STEP * columns, is_dense=bool(np.isfinite(points.xyz).all()), check_fields=True)
    message.data = bytes_of(packed.view(np.uint8))
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
    """The contacts; members, which the message does not carry, are empty. Raises BadFrame for invalid numbers."""
    check_numbers(message)
    return [ContactEstimate(c.id, _xyz(c.position), _xyz(c.normal), c.depth, c.force, np.array(c.position_covariance).reshape(3, 3),
                            c.flags, np.zeros(0, bool)) for c in message.contacts]


def region_from_message(message: ContactRegion) -> ContactRegionEstimate:
    """The region. Raises BadFrame for different numbers of dots and states, an undefined state, or an invalid number."""
    check_numbers(message)
    ids, states = np.array(message.dot_id, np.int64), np.array(message.dot_state, np.uint8)
    return ContactRegionEstimate(ids, states, [_loop(loop) for loop in message.outlines], [_loop(loop) for loop in message.holes],
                                 message.area, _xyz(message.centroid), _xyz(message.normal), message.orientation, message.major_axis,
                                 message.minor_axis, *_motion(message.motion), message.motion_interval, *_motion(message.pose),
                                 np.array(message.dot_confidence, float))


def slip_from_message(message: Slip) -> SlipEstimate:
    """The slip. Raises BadFrame for an undefined state, arrays of different lengths, or an infinite number."""
    check_numbers(message)
    positions = (np.array(getattr(message, name), float) for name in ('x', 'y', 'vx', 'vy'))
    return SlipEstimate(message.state, message.slipping_fraction, _xyz(message.velocity.linear), _xyz(message.velocity.angular),
                        _xyz(message.rotation_center), *positions, message.confidence)


def wrench_from_message(message: WrenchStamped) -> np.ndarray:
    """(6,) N and N m. Raises BadFrame for an infinite number."""
    check_numbers(message)
    return np.concatenate([_xyz(message.wrench.force), _xyz(message.wrench.torque)])


def _xyz(point) -> np.ndarray:
    return np.array([point.x, point.y, point.z])


def _motion(transform) -> tuple[np.ndarray, np.ndarray]:
    turn = transform.rotation
    return _xyz(transform.translation), np.array([turn.x, turn.y, turn.z, turn.w])


def _loop(polygon) -> np.ndarray:
    return np.array([(p.x, p.y, p.z) for p in polygon.points], float).reshape(-1, 3)
