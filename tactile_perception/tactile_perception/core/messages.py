# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Checks of messages, and what of a message needs no sensor's model: its stamp, its camera, the numbers of its dots.

ROS passes any number and arrays of any length: checks raise BadFrame, which says what is wrong and where. A message that passed has
parallel arrays of equal lengths, and numbers that are finite, or NaN where unknown.
"""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.recordings.written_message import WrittenMessage
from tactile_msgs.msg import Contact, ContactRegion, Contacts, DotTracks, Slip

from .constants import CORE
from .errors import BadFrame

_IN_IMAGE, _POSITION_FIELDS = ('u', 'v', 'du', 'dv', 'area'), ('x', 'y', 'z')


def dot_numbers(message: DotTracks) -> tuple[np.ndarray, np.ndarray]:
    """Check a message of dots and return its numbers.

    Parameters
    ----------
    message : DotTracks
        Message of a tracker or of a recording.

    Returns
    -------
    ids : ndarray of int64, shape (N,)
        Number of each dot.
    numbers : ndarray, shape (8, N)
        u, v, du, dv (px), area (px^2), x, y, z (m); shape (5, N) without positions.

    Raises
    ------
    BadFrame
        If arrays differ in length, a number appears twice or is not on the grid, or a position is outside any image.
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
    limits = np.array([CORE.max_px] * 4 + [CORE.max_px**2] + [CORE.max_m] * 3)[:len(names)]
    if (np.abs(numbers) > limits[:, None]).any() or np.isnan(numbers[:2]).any():
        for name, values, limit in zip(names, numbers, limits):
            _check_values(f'dots: {name}', values, limit, known=name in 'uv')
    if (numbers[_IN_IMAGE.index('area')] <= 0).any():
        raise BadFrame('dots: an area is not above 0; publish NaN where it is not known')
    return ids, numbers


#: Type of a message -> name of a field or of one within it, and the largest magnitude of its numbers.
_LIMITS = {
    ContactRegion: {**dict.fromkeys(('centroid', 'normal', 'motion', 'pose', 'area', 'dot_confidence', 'orientation', 'major_axis',
                                     'minor_axis'), CORE.max_m), **dict.fromkeys(('motion_interval', 'motion_covariance'), CORE.max_value)},
    Contact: {'position': CORE.max_m, **dict.fromkeys(('normal', 'depth', 'force', 'position_covariance'), CORE.max_value)},
    Slip: dict.fromkeys(('x', 'y', 'vx', 'vy', 'slipping_fraction', 'confidence', 'rotation_center', 'velocity',
                         'velocity_covariance'), CORE.max_value),
    WrenchStamped: {'wrench': CORE.max_value},
}


def check_message(message) -> None:
    """Check the stamp of any message, the layout of an image, and the numbers of a result.

    Parameters
    ----------
    message : any message with a header
        An image is decoded for it.

    Raises
    ------
    BadFrame
        If the stamp is invalid, or as `image_to_array` and `check_numbers` do.
    """
    stamp_ns_of(message.header)
    if isinstance(message, (Image, CompressedImage)):
        image_to_array(message)
    check_numbers(message)


def check_numbers(message) -> None:
    """Check the numbers of dots or of a result.

    Parameters
    ----------
    message : DotTracks, ContactRegion, Contacts, Slip or WrenchStamped
        A message of another type passes.

    Raises
    ------
    BadFrame
        If arrays that belong together differ in length, a state is not defined, or a number is infinite or beyond every sensor.
    """
    if isinstance(message, WrittenMessage):
        message = message.message
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
                _check_values(f'contact_region: {name}', [c for p in loop.points for c in (p.x, p.y, p.z)], CORE.max_m, known=True)
    elif isinstance(message, Slip):
        if message.state > Slip.GROSS:
            raise BadFrame(f'slip: state {message.state} is not one of 0 to {Slip.GROSS}')
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


def camera_matrices(message: CameraInfo) -> tuple[np.ndarray, np.ndarray] | None:
    """Camera matrix and distortion of a camera_info.

    Parameters
    ----------
    message : CameraInfo
        With the distortion model plumb_bob.

    Returns
    -------
    matrix : ndarray, shape (3, 3)
        K in px.
    distortion : ndarray, shape (5,)
        k1, k2, p1, p2, k3.
        None is returned instead of both for a camera that is not calibrated: its K is zero.

    Raises
    ------
    BadFrame
        If the distortion model is another one, or the numbers fit no camera.
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
    distortion[np.abs(distortion) < CORE.no_distortion] = 0.0
    return matrix, distortion


def _check_camera(matrix: np.ndarray, distortion: np.ndarray) -> None:
    """Raise BadFrame unless K (3, 3) and the plumb_bob coefficients are finite and plausible."""
    focus, middle = matrix[[0, 1], [0, 1]], matrix[:2, 2]
    rest = matrix[[0, 1, 2, 2, 2], [1, 0, 0, 1, 2]]
    if not ((focus >= CORE.min_focal_length_px) & (focus <= CORE.max_px)).all() or not (np.abs(middle) <= CORE.max_px).all() \
            or rest.tolist() != [0, 0, 0, 0, 1]:
        raise BadFrame(f'camera_info: k {matrix.ravel().tolist()} is not of a camera, [fx 0 cx, 0 fy cy, 0 0 1] in px with fx and fy from '
                       f'{CORE.min_focal_length_px:g} px on; calibrate the camera, or publish zeros where it is not calibrated')
    if not (np.abs(distortion) <= CORE.max_distortion).all():
        raise BadFrame(f'camera_info: distortion {distortion.tolist()} is beyond any lens; calibrate the camera')


def stamp_seconds(header) -> float:
    """Stamp of a header in s.

    Parameters
    ----------
    header : Header
        Of any message.

    Returns
    -------
    float

    Raises
    ------
    BadFrame
        If the stamp is invalid.
    """
    stamp_ns_of(header)
    return header.stamp.sec + 1e-9 * header.stamp.nanosec
