# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What messages of dots and results have to hold: anybody may publish, and ROS lets through any number and arrays of any lengths.

Each check raises BadFrame, which says what is wrong and where; behind it arrays run in parallel, and numbers are finite, or NaN where they
are not known.
"""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import WrenchStamped
from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_msgs.msg import ContactRegion, Contacts, DotTracks, Slip

from ...errors import BadFrame

_FARTHEST_PX = 1e6  # no image is so wide
_LARGEST_PX2 = 1e12
_FARTHEST_M = 100.0  # a sensor's frame is on the sensor
_LARGEST = 1e9  # of forces, velocities, covariances in SI units
_PLACES = ('x', 'y', 'z')


def check_dots(message: DotTracks) -> None:
    """Arrays in parallel, numbers on the grid and each once, places in an image."""
    count = len(message.id)
    _check_lengths('dots', message, ('u', 'v', 'area', 'du', 'dv'), count)
    if {len(getattr(message, name)) for name in _PLACES} not in ({0}, {count}):
        lengths = ', '.join(str(len(getattr(message, name))) for name in _PLACES)
        raise BadFrame(f'dots: x, y, z have {lengths} entries, id has {count}')
    _check_ids('dots', np.asarray(message.id, np.int64), message.rows * message.columns)
    for names, limit in ((('u', 'v', 'du', 'dv'), _FARTHEST_PX), (('area',), _LARGEST_PX2), (_PLACES, _FARTHEST_M)):
        for name in names:
            _check_numbers(f'dots: {name}', getattr(message, name), limit, known=name in 'uv')
    if (np.asarray(message.area) <= 0).any():
        raise BadFrame('dots: an area is not above 0; NaN says that it is not known')


def check_region(message: ContactRegion) -> None:
    """Dots and states in parallel, outlines finite, the rest finite or not known."""
    states = np.asarray(message.dot_state, np.int64)
    if len(message.dot_id) != len(states) or (states > ContactRegion.SLIPPING).any():
        raise BadFrame(f'contact_region: {len(message.dot_id)} dots with {len(states)} states of 0 to {ContactRegion.SLIPPING}; both '
                       'arrays have to run in parallel')
    for name in ('outlines', 'holes'):
        for loop in getattr(message, name):
            _check_numbers(f'contact_region: {name}', [c for p in loop.points for c in (p.x, p.y, p.z)], _FARTHEST_M, known=True)
    motion = message.motion
    for name, values in (('centroid', _xyz(message.centroid)), ('normal', _xyz(message.normal)), ('motion', _xyz(motion.translation)),
                         ('motion', (*_xyz(motion.rotation), motion.rotation.w)), ('area', (message.area,)),
                         ('axes', (message.orientation, message.major_axis, message.minor_axis))):
        _check_numbers(f'contact_region: {name}', values, _FARTHEST_M)
    _check_numbers('contact_region: motion_interval', (message.motion_interval,), _LARGEST)


def check_contacts(message: Contacts) -> None:
    """Each contact's numbers finite or not known."""
    for contact in message.contacts:
        _check_numbers('contacts: position', _xyz(contact.position), _FARTHEST_M)
        for name, values in (('normal', _xyz(contact.normal)), ('depth', (contact.depth,)), ('force', (contact.force,)),
                             ('position_covariance', contact.position_covariance)):
            _check_numbers(f'contacts: {name}', values, _LARGEST)


def check_slip(message: Slip) -> None:
    """A state that there is, places and velocities in parallel, numbers finite or not known."""
    if message.state > Slip.GROSS:
        raise BadFrame(f'slip: state {message.state} is none of 0 to {Slip.GROSS}')
    _check_lengths('slip', message, ('y', 'vx', 'vy'), len(message.x), 'x')
    for name in ('x', 'y', 'vx', 'vy'):
        _check_numbers(f'slip: {name}', getattr(message, name), _LARGEST)
    for name, values in (('slipping_fraction', (message.slipping_fraction,)), ('rotation_center', _xyz(message.rotation_center)),
                         ('velocity', (*_xyz(message.velocity.linear), *_xyz(message.velocity.angular)))):
        _check_numbers(f'slip: {name}', values, _LARGEST)


def check_wrench(message: WrenchStamped) -> None:
    """Numbers finite or not known."""
    _check_numbers('wrench', (*_xyz(message.wrench.force), *_xyz(message.wrench.torque)), _LARGEST)


_CHECKS = {DotTracks: check_dots, ContactRegion: check_region, Contacts: check_contacts, Slip: check_slip, WrenchStamped: check_wrench}


def check_message(message) -> None:
    """The stamp of a raw message or a result, and of a result its numbers; an image is checked where it becomes an array."""
    stamp_ns_of(message.header)
    if type(message) in _CHECKS:
        _CHECKS[type(message)](message)


def _check_lengths(topic: str, message, names: Sequence[str], count: int, like: str = 'id') -> None:
    for name in names:
        if len(getattr(message, name)) != count:
            raise BadFrame(f'{topic}: {name} has {len(getattr(message, name))} entries, {like} has {count}; whoever publishes {topic} '
                           'has to fill both alike')


def _check_ids(topic: str, ids: np.ndarray, count: int) -> None:
    """Each once, and below count, 0 for a pattern that is no grid."""
    if count and len(ids) and ids.max() >= count:
        raise BadFrame(f'{topic}: number {ids.max()} is beyond the grid of {count}; rows and columns of tracker and publisher differ')
    if len(np.unique(ids)) != len(ids):
        raise BadFrame(f'{topic}: a number stands twice in id; each dot has its own')


def _check_numbers(what: str, values, limit: float, known: bool = False) -> None:
    """Raise BadFrame for a number of more than limit; for NaN too where it has to be known."""
    values = np.asarray(values, float)
    bad = ~(np.abs(values) <= limit)
    if not known and bad.any():
        bad &= ~np.isnan(values)
    if bad.any():
        raise BadFrame(f'{what} holds {values[bad][0]:g}; up to {limit:g} can be meant, ' + ('not NaN' if known else 'NaN: not known'))


def _xyz(vector) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z
