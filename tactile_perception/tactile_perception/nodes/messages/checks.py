# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Checks of received dots and results: ROS passes any number and arrays of any lengths.

Each check raises BadFrame, which says what is wrong and where. A message that passed has parallel arrays of equal lengths, and numbers that
are finite, or NaN where not known.
"""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import WrenchStamped
from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_msgs.msg import ContactRegion, Contacts, DotTracks, Slip

from ...errors import BadFrame

# Limits beyond every sensor; products of numbers within them do not overflow. Chosen.
_FARTHEST_PX = 1e6  # wider than any image
_LARGEST_PX2 = _FARTHEST_PX**2
_FARTHEST_M = 100.0  # from the origin, which is on the sensor
_LARGEST = 1e9  # of forces, velocities, covariances in SI units
_IN_IMAGE, _PLACES = ('u', 'v', 'du', 'dv', 'area'), ('x', 'y', 'z')
_DOT_LIMITS = np.array([_FARTHEST_PX] * 4 + [_LARGEST_PX2] + [_FARTHEST_M] * 3)


def check_dots(message: DotTracks) -> None:
    """Check dots as dot_numbers does. Raises BadFrame."""
    dot_numbers(message)


def dot_numbers(message: DotTracks) -> tuple[np.ndarray, np.ndarray]:
    """Indices (N,) int64 of dots, and (8, N) float64 u, v, du, dv, area, x, y, z; (5, N) without places.

    Raises BadFrame unless arrays have equal lengths, indices are unique and on the grid, and places within an image.
    """
    count = len(message.id)
    _check_lengths('dots', message, _IN_IMAGE, count)
    places = [len(getattr(message, name)) for name in _PLACES]
    if set(places) not in ({0}, {count}):
        raise BadFrame(f'dots: x, y, z have {", ".join(map(str, places))} entries, id has {count}')
    ids = np.asarray(message.id, np.int64)
    _check_ids('dots', ids, message.rows * message.columns)
    names = (*_IN_IMAGE, *_PLACES) if count and places[0] else _IN_IMAGE
    numbers = np.stack([np.asarray(getattr(message, name)) for name in names]).astype(float)
    limits = _DOT_LIMITS[:len(names)]
    if (np.abs(numbers) > limits[:, None]).any() or np.isnan(numbers[:2]).any():
        for name, values, limit in zip(names, numbers, limits):
            _check_numbers(f'dots: {name}', values, limit, known=name in 'uv')
    if (numbers[_IN_IMAGE.index('area')] <= 0).any():
        raise BadFrame('dots: an area is not above 0; publish NaN where it is not known')
    return ids, numbers


def check_region(message: ContactRegion) -> None:
    """Check a region: as many states as dots, finite outlines, the rest finite or NaN. Raises BadFrame."""
    states = np.asarray(message.dot_state, np.int64)
    if len(message.dot_id) != len(states) or (states > ContactRegion.SLIPPING).any():
        raise BadFrame(f'contact_region: {len(message.dot_id)} dots with {len(states)} states of 0 to {ContactRegion.SLIPPING}; both '
                       'arrays must have the same length')
    for name in ('outlines', 'holes'):
        for loop in getattr(message, name):
            _check_numbers(f'contact_region: {name}', [c for p in loop.points for c in (p.x, p.y, p.z)], _FARTHEST_M, known=True)
    if len(message.dot_confidence) not in (0, len(states)):
        raise BadFrame(f'contact_region: {len(message.dot_confidence)} confidences of {len(states)} dots; one each, or none at all')
    for name, values in (('centroid', _xyz(message.centroid)), ('normal', _xyz(message.normal)), ('motion', _transform(message.motion)),
                         ('pose', _transform(message.pose)), ('area', (message.area,)), ('dot_confidence', message.dot_confidence),
                         ('axes', (message.orientation, message.major_axis, message.minor_axis))):
        _check_numbers(f'contact_region: {name}', values, _FARTHEST_M)
    _check_numbers('contact_region: motion_interval', (message.motion_interval,), _LARGEST)


def _transform(transform) -> tuple[float, ...]:
    return *_xyz(transform.translation), *_xyz(transform.rotation), transform.rotation.w


def check_contacts(message: Contacts) -> None:
    """Check contacts: numbers finite or NaN. Raises BadFrame."""
    for contact in message.contacts:
        _check_numbers('contacts: position', _xyz(contact.position), _FARTHEST_M)
        for name, values in (('normal', _xyz(contact.normal)), ('depth', (contact.depth,)), ('force', (contact.force,)),
                             ('position_covariance', contact.position_covariance)):
            _check_numbers(f'contacts: {name}', values, _LARGEST)


def check_slip(message: Slip) -> None:
    """Check slip: a defined state, as many velocities as places, numbers finite or NaN. Raises BadFrame."""
    if message.state > Slip.GROSS:
        raise BadFrame(f'slip: state {message.state} is none of 0 to {Slip.GROSS}')
    _check_lengths('slip', message, ('y', 'vx', 'vy'), len(message.x), 'x')
    for name in ('x', 'y', 'vx', 'vy'):
        _check_numbers(f'slip: {name}', getattr(message, name), _LARGEST)
    for name, values in (('slipping_fraction', (message.slipping_fraction,)), ('confidence', (message.confidence,)),
                         ('rotation_center', _xyz(message.rotation_center)),
                         ('velocity', (*_xyz(message.velocity.linear), *_xyz(message.velocity.angular)))):
        _check_numbers(f'slip: {name}', values, _LARGEST)


def check_wrench(message: WrenchStamped) -> None:
    """Check a wrench: numbers finite or NaN. Raises BadFrame."""
    _check_numbers('wrench', (*_xyz(message.wrench.force), *_xyz(message.wrench.torque)), _LARGEST)


_CHECKS = {DotTracks: check_dots, ContactRegion: check_region, Contacts: check_contacts, Slip: check_slip, WrenchStamped: check_wrench}


def check_message(message) -> None:
    """Check the stamp of any message, and the numbers of a result; images are checked by image_to_array. Raises BadFrame."""
    stamp_ns_of(message.header)
    if type(message) in _CHECKS:
        _CHECKS[type(message)](message)


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


def _check_numbers(what: str, values, limit: float, known: bool = False) -> None:
    """Raise BadFrame for a magnitude above limit, and for NaN where the value must be known."""
    values = np.asarray(values, float)
    bad = ~(np.abs(values) <= limit)
    if not known and bad.any():
        bad &= ~np.isnan(values)
    if bad.any():
        raise BadFrame(f'{what} holds {values[bad][0]:g}; allowed are magnitudes up to {limit:g}{"" if known else ", and NaN: not known"}')


def _xyz(vector) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z
