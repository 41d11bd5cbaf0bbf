# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Conversions from result messages to estimates, for readers of recorded results and of ground truth, which has the same types."""
from __future__ import annotations

import numpy as np
from geometry_msgs.msg import WrenchStamped
from tactile_msgs.msg import ContactRegion, Contacts, Slip

from .checks import check_numbers
from ...common.estimates import ContactEstimate, ContactRegionEstimate, SlipEstimate


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
    places = (np.array(getattr(message, name), float) for name in ('x', 'y', 'vx', 'vy'))
    return SlipEstimate(message.state, message.slipping_fraction, _xyz(message.velocity.linear), _xyz(message.velocity.angular),
                        _xyz(message.rotation_center), *places, message.confidence)


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
