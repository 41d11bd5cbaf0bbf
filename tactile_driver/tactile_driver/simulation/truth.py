# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The ground truth of a simulated frame: dots, contact, slip and forces; and what keeps it for each frame."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np

Known = TypeVar('Known')
NON_CONTACT, STICKING, SLIPPING = 0, 1, 2
NO_SLIP, INCIPIENT, GROSS = 0, 1, 2


def slip_state_of(fraction: float) -> int:
    """Return NO_SLIP, INCIPIENT or GROSS of a contact of which this fraction slips."""
    return NO_SLIP if fraction < 0.05 else INCIPIENT if fraction < 0.9 else GROSS


@dataclass
class Touch:
    """One contact.

    Attributes
    ----------
    position : ndarray, shape (3,)
        Contact point on the deformed surface, in m.
    normal : ndarray, shape (3,)
        Unit vector towards the object.
    depth : float
        Distance along z by which the object must retract to just touch the undeformed surface, in m.
    force : float
        Force along the normal, in N.
    """

    position: np.ndarray
    normal: np.ndarray
    depth: float
    force: float


def _unknown(count: int) -> np.ndarray:
    return field(default_factory=lambda: np.full(count, np.nan))


@dataclass
class TruthFrame:
    """Ground truth of one frame, in the sensor frame.

    Attributes
    ----------
    dot_id : ndarray of int64, shape (K,)
        row * columns + column of each dot.
    dot_uv : ndarray, shape (K, 2)
        Image of the dot's centre, of wide markers the centroid of its image, in px.
    dot_xyz : ndarray, shape (K, 3)
        Positions, in m.
    dot_state : ndarray of uint8, shape (K,)
        NON_CONTACT, STICKING or SLIPPING over the interval since the previous frame.
    outlines, holes : list of ndarray, shape (n, 3)
        Borders of the contact region, in m.
    area : float
        Area without holes, in m^2.
    centroid, normal : ndarray, shape (3,)
        Those of the region, the first in m; NaN without contact.
    contacts : list of Touch
        The separate contacts.
    slip_state : int
        As of `slip_state_of`.
    slipping_fraction : float
        Slipping share of the contact area.
    velocity : ndarray, shape (6,)
        Slip twist of the object relative to the skin at the sensor frame's origin, in m/s and rad/s; 0 without slip, NaN without contact.
    rotation_center : ndarray, shape (3,)
        Centre of rotation of that twist in the contact plane, in m; NaN for pure translation.
    motion : ndarray, shape (6,)
        Displacement of the object since the previous frame at the sensor frame's origin, in m and rad; NaN without contact.
    pose : ndarray, shape (6,)
        The same since the frame in which it touched.
    wrench : ndarray, shape (6,)
        Wrench of the object on the sensor at the sensor frame's origin, in N and N m.
    pressure : float
        Gauge pressure inside the skin, in Pa.
    dot_gap : ndarray, shape (K,), or None
        Distance of each dot from the object, in m; inf without contact, None if unknown.
    tip : ndarray, shape (3,)
        Lowest point of a round tip that is near, whether it touches or not, in m; NaN of none.
    """

    dot_id: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    dot_uv: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    dot_xyz: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    dot_state: np.ndarray = field(default_factory=lambda: np.zeros(0, np.uint8))
    outlines: list = field(default_factory=list)
    holes: list = field(default_factory=list)
    area: float = 0.0
    centroid: np.ndarray = _unknown(3)
    normal: np.ndarray = _unknown(3)
    contacts: list = field(default_factory=list)
    slip_state: int = NO_SLIP
    slipping_fraction: float = 0.0
    velocity: np.ndarray = _unknown(6)
    rotation_center: np.ndarray = _unknown(3)
    motion: np.ndarray = _unknown(6)
    pose: np.ndarray = _unknown(6)
    wrench: np.ndarray = field(default_factory=lambda: np.zeros(6))
    pressure: float = np.nan
    dot_gap: np.ndarray | None = None
    tip: np.ndarray = _unknown(3)


@dataclass
class SimulatedFrame:
    """One frame of a scene.

    Attributes
    ----------
    image : ndarray of uint8, shape (height, width, 3)
        BGR image.
    truth : TruthFrame
        Its ground truth.
    """

    image: np.ndarray
    truth: TruthFrame


class FramesInOrder(Generic[Known]):
    """What is known of a scene's frames, each computed after those before it and kept.

    Subclasses set `frames`, the number of those of a round, and `_known`, a list, and implement `_next`, which computes what comes next.
    """

    frames: int
    _known: list[Known]

    def observe(self, number: int) -> Known:
        """Return what is known of the frame of that number; the scene repeats."""
        while self.observe_ahead(number % self.frames):
            pass
        return self._known[number % self.frames]

    def observe_ahead(self, number: int) -> bool:
        """Compute one frame that is not known yet; False if those up to number and one round are known."""
        ahead = len(self._known) <= min(number, self.frames - 1)
        if ahead:
            self._known.append(self._next())
        return ahead
