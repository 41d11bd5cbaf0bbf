# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Estimates of all sensors, with the fields of their messages: contacts, contact regions, slip. NaN: unknown."""
from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

OUT_OF_RANGE, AT_EDGE, AMBIGUOUS, SATURATED = 1, 2, 4, 8
_UNKNOWN = np.full(4, np.nan)


@dataclass(frozen=True)
class ContactEstimate:
    """The fields of tactile_msgs/Contact, and the dots that belong to it.

    id: kept while the touch lasts; position: (3,) m; normal: (3,) unit, towards the object; depth: m; force: N along the mean normal of
    the region, NaN when unknown; position_covariance: (3, 3) m^2; flags: of OUT_OF_RANGE, AT_EDGE, AMBIGUOUS; members: (N,) bool of the
    frame's dots.
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
    """The fields of tactile_msgs/ContactRegion; unknown is NaN; area is 0 without contact.

    dot_id, dot_state: (N,); outlines, holes: lists of (M, 3) m; area: m^2 on the surface; centroid, normal: (3,); orientation: rad in
    (-pi/2, pi/2]; major_axis, minor_axis: m, full lengths of the ellipse of the same moments; motion_rotation: (4,) quaternion x y z w and
    motion_translation: (3,) m, so that a point of the object at x comes to rotation x + translation, over motion_interval s;
    pose_rotation, pose_translation: the same since the object touched; dot_confidence: (N,) probability of each dot_state, or empty.
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
    pose_translation: np.ndarray = field(default_factory=_UNKNOWN[:3].copy)
    pose_rotation: np.ndarray = field(default_factory=_UNKNOWN.copy)
    dot_confidence: np.ndarray = field(default_factory=lambda: np.zeros(0))


NONE, INCIPIENT, GROSS = 0, 1, 2


@dataclass
class SlipEstimate:
    """The fields of tactile_msgs/Slip; NaN: unknown.

    state: NONE, INCIPIENT or GROSS; slipping_fraction: of the dots in contact, NaN without contact; linear, angular: (3,) m/s, rad/s,
    twist of the object over the surface at the frame's origin, 0 while all dots stick; rotation_center: (3,) m; x, y: (S,) m, positions of
    the slipping dots; vx, vy: (S,) m/s, of the object over the surface there; confidence: probability of state, NaN where none is stated.
    """

    state: int = NONE
    slipping_fraction: float = np.nan
    linear: np.ndarray = field(default_factory=_UNKNOWN[:3].copy)
    angular: np.ndarray = field(default_factory=_UNKNOWN[:3].copy)
    rotation_center: np.ndarray = field(default_factory=_UNKNOWN[:3].copy)
    x: np.ndarray = field(default_factory=lambda: np.zeros(0))
    y: np.ndarray = field(default_factory=lambda: np.zeros(0))
    vx: np.ndarray = field(default_factory=lambda: np.zeros(0))
    vy: np.ndarray = field(default_factory=lambda: np.zeros(0))
    confidence: float = np.nan


# Slipping fractions at which a state begins, and below which it ends (hysteresis against single dots). Chosen.
_INCIPIENT = (0.05, 0.03)
STILL_GROSS = 0.85
_GROSS = (0.90, STILL_GROSS)
FAR = 4.0  # radii of the contact: a centre of rotation farther away counts as a translation. Chosen
_COINCIDENT = 1e-24  # m^2: squares of the distance of positions a picometre apart


def next_state(state: int, fraction: float) -> int:
    """State from the slipping fraction, with hysteresis."""
    if fraction >= _GROSS[state == GROSS]:
        return GROSS
    return INCIPIENT if fraction >= _INCIPIENT[state != NONE] else NONE


def state_probability(state: int, fraction: float, patches: float) -> float:
    """Probability that the true slipping fraction is that of state, where the estimated one is of so many patches, each of which slips or
    sticks by itself (normal approximation of the binomial distribution)."""
    least, most = (-math.inf, _INCIPIENT[0], _GROSS[0], math.inf)[state:state + 2]
    spread = math.sqrt(2 * max(fraction * (1 - fraction), 1e-9) / patches)
    return 0.5 * (math.erf((most - fraction) / spread) - math.erf((least - fraction) / spread))


def planar_twist(position: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
    """Velocity (2,) at the origin, angular velocity, and centre of rotation (2,), NaN for a translation, from velocity (S, 2) at position
    (S, 2); all NaN for coincident or NaN positions."""
    unknown = np.full(2, np.nan)
    if not len(position):
        return unknown, np.nan, unknown
    middle, drift = np.mean(position, axis=0), np.mean(velocity, axis=0)
    (x, y), (u, v) = (position - middle).T, (velocity - drift).T
    spread = x @ x + y @ y
    if not _COINCIDENT < spread < np.inf:
        return unknown, np.nan, unknown
    turn = (x @ v - y @ u) / spread
    linear = drift + turn * np.array([middle[1], -middle[0]])
    if math.hypot(*drift) >= abs(turn) * FAR * math.sqrt(spread / len(position)):
        return linear, turn, unknown
    return linear, turn, middle + np.array([-drift[1], drift[0]]) / turn
