# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Estimates of all sensors, with the fields of their messages: contacts, contact regions, slip. NaN: unknown."""
from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from .constants import COMMON

OUT_OF_RANGE, AT_EDGE, AMBIGUOUS, SATURATED = 1, 2, 4, 8  # flags of tactile_msgs/Contact
NONE, INCIPIENT, GROSS = range(3)  # states of tactile_msgs/Slip
_UNKNOWN, _NOT_STATED = np.full(4, np.nan), np.full((6, 6), np.nan)


@dataclass(frozen=True)
class ContactEstimate:
    """The fields of tactile_msgs/Contact, and the dots that belong to it.

    Parameters
    ----------
    id : int
        Constant while the contact lasts.
    position, normal : ndarray, shape (3,)
        Position in m, and unit normal towards the object.
    depth : float
        In m.
    force : float
        Along the mean normal of the region, in N; NaN when unknown.
    position_covariance : ndarray, shape (3, 3)
        In m^2.
    flags : int
        Sum of OUT_OF_RANGE, AT_EDGE, AMBIGUOUS and SATURATED.
    members : ndarray of bool, shape (N,)
        Which dots of the frame belong to the contact.
    """

    id: int
    position: np.ndarray
    normal: np.ndarray
    depth: float
    force: float
    position_covariance: np.ndarray
    flags: int
    members: np.ndarray


@dataclass
class ContactRegionEstimate:
    """The fields of tactile_msgs/ContactRegion; unknown is NaN; the area is 0 without contact.

    Parameters
    ----------
    dot_id, dot_state : ndarray, shape (N,)
        Number and state of each dot.
    outlines, holes : list of ndarray, shape (M, 3)
        In m.
    area : float
        On the surface, in m^2.
    centroid, normal : ndarray, shape (3,)
        In m, and unit vector.
    orientation : float
        In rad, above -pi/2 and up to pi/2.
    major_axis, minor_axis : float
        Full lengths of the ellipse with the same moments, in m.
    motion_translation, motion_rotation : ndarray, shape (3,) and (4,)
        In m, and quaternion x, y, z, w: a point of the object at x moves to rotation x + translation.
    motion_interval : float
        Duration of that motion in s.
    motion_covariance : ndarray, shape (6, 6)
        Of translation in m and rotation vector in rad; NaN where none is stated.
    pose_translation, pose_rotation : ndarray, shape (3,) and (4,)
        The same since the object touched.
    dot_confidence : ndarray, shape (N,) or (0,)
        Probability of each dot_state.
    """

    dot_id: np.ndarray
    dot_state: np.ndarray
    outlines: list[np.ndarray] = field(default_factory=list)
    holes: list[np.ndarray] = field(default_factory=list)
    area: float = 0.0
    centroid: np.ndarray = field(default_factory=_UNKNOWN[:3].copy)
    normal: np.ndarray = field(default_factory=_UNKNOWN[:3].copy)
    orientation: float = np.nan
    major_axis: float = np.nan
    minor_axis: float = np.nan
    motion_translation: np.ndarray = field(default_factory=_UNKNOWN[:3].copy)
    motion_rotation: np.ndarray = field(default_factory=_UNKNOWN.copy)
    motion_interval: float = np.nan
    motion_covariance: np.ndarray = field(default_factory=_NOT_STATED.copy)
    pose_translation: np.ndarray = field(default_factory=_UNKNOWN[:3].copy)
    pose_rotation: np.ndarray = field(default_factory=_UNKNOWN.copy)
    dot_confidence: np.ndarray = field(default_factory=lambda: np.zeros(0))


def planar_covariance(covariance: np.ndarray) -> np.ndarray:
    """Covariance (6, 6) of a motion in the x-y plane from that of x, y and the rotation about z (3, 3): the others are 0 by definition."""
    whole = np.zeros((6, 6))
    planar = 0, 1, 5  # x, y and the rotation about z
    whole[np.ix_(planar, planar)] = covariance
    return whole


@dataclass
class SlipEstimate:
    """The fields of tactile_msgs/Slip; unknown is NaN.

    Parameters
    ----------
    state : int
        NONE, INCIPIENT or GROSS.
    slipping_fraction : float
        Of the dots in contact; NaN without contact.
    linear, angular : ndarray, shape (3,)
        Twist of the object over the surface at the origin of the frame, in m/s and rad/s; 0 while all dots stick.
    velocity_covariance : ndarray, shape (6, 6)
        Of linear and angular; NaN where none is stated.
    rotation_center : ndarray, shape (3,)
        In m.
    x, y : ndarray, shape (S,)
        Positions of the slipping dots in m.
    vx, vy : ndarray, shape (S,)
        Velocity of the object over the surface there in m/s.
    confidence : float
        Probability of the state; NaN where none is stated.
    """

    state: int = NONE
    slipping_fraction: float = np.nan
    linear: np.ndarray = field(default_factory=_UNKNOWN[:3].copy)
    angular: np.ndarray = field(default_factory=_UNKNOWN[:3].copy)
    velocity_covariance: np.ndarray = field(default_factory=_NOT_STATED.copy)
    rotation_center: np.ndarray = field(default_factory=_UNKNOWN[:3].copy)
    x: np.ndarray = field(default_factory=lambda: np.zeros(0))
    y: np.ndarray = field(default_factory=lambda: np.zeros(0))
    vx: np.ndarray = field(default_factory=lambda: np.zeros(0))
    vy: np.ndarray = field(default_factory=lambda: np.zeros(0))
    confidence: float = np.nan


def next_state(state: int, fraction: float) -> int:
    """State of slip from the slipping fraction, with hysteresis.

    Parameters
    ----------
    state : int
        Present state.
    fraction : float
        Slipping fraction.

    Returns
    -------
    int
        NONE, INCIPIENT or GROSS.

    Examples
    --------
    >>> next_state(NONE, 0.04), next_state(INCIPIENT, 0.04), next_state(INCIPIENT, 0.95)
    (0, 1, 2)
    """
    if fraction >= (COMMON.ends_gross if state == GROSS else COMMON.begins_gross):
        return GROSS
    return INCIPIENT if fraction >= (COMMON.begins_incipient if state == NONE else COMMON.ends_incipient) else NONE


def state_probability(state: int, fraction: float, patches: float) -> float:
    """Probability that the true slipping fraction is that of a state.

    Parameters
    ----------
    state : int
        NONE, INCIPIENT or GROSS.
    fraction : float
        Estimated slipping fraction.
    patches : float
        Number of patches, each of which slips or sticks independently.

    Returns
    -------
    float

    Notes
    -----
    Normal approximation of the binomial distribution.
    """
    low, high = (-math.inf, COMMON.begins_incipient, COMMON.begins_gross, math.inf)[state:state + 2]
    spread = math.sqrt(2 * max(fraction * (1 - fraction), 1e-9) / patches)
    return 0.5 * (math.erf((high - fraction) / spread) - math.erf((low - fraction) / spread))


def planar_twist(position: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
    """Twist and centre of rotation of velocities in a plane.

    Parameters
    ----------
    position, velocity : ndarray, shape (S, 2)
        Points and their velocities.

    Returns
    -------
    linear : ndarray, shape (2,)
        Velocity at the origin.
    angular : float
        Angular velocity.
    centre : ndarray, shape (2,)
        Centre of rotation; NaN for a translation. All is NaN for coincident or NaN positions.

    Examples
    --------
    >>> linear, angular, centre = planar_twist(np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([[0.0, 2.0], [0.0, -2.0]]))
    >>> linear, float(angular), centre
    (array([0., 0.]), 2.0, array([0., 0.]))
    """
    unknown = np.full(2, np.nan)
    if not len(position):
        return unknown, np.nan, unknown
    middle, drift = np.mean(position, axis=0), np.mean(velocity, axis=0)
    (x, y), (u, v) = (position - middle).T, (velocity - drift).T
    spread = x @ x + y @ y
    if not COMMON.coincident < spread < np.inf:
        return unknown, np.nan, unknown
    turn = (x @ v - y @ u) / spread
    linear = drift + turn * np.array([middle[1], -middle[0]])
    if math.hypot(*drift) >= abs(turn) * COMMON.max_centre_distance * math.sqrt(spread / len(position)):
        return linear, turn, unknown
    return linear, turn, middle + np.array([-drift[1], drift[0]]) / turn
