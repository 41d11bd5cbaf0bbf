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
    """Of a contact of which this fraction slips."""
    return NO_SLIP if fraction < 0.05 else INCIPIENT if fraction < 0.9 else GROSS


@dataclass
class Touch:
    """One contact. position: (3,) m, contact point on the deformed surface; normal: (3,) unit, towards the object; depth: m, distance along
    z by which the object must retract to just touch the undeformed surface; force: N, along the normal."""

    position: np.ndarray
    normal: np.ndarray
    depth: float
    force: float


def _unknown(count: int) -> np.ndarray:
    return field(default_factory=lambda: np.full(count, np.nan))


@dataclass
class TruthFrame:
    """Ground truth of one frame, in the sensor frame.

    dot_id: (K,) int64, row * columns + column; dot_uv: (K, 2) px, image of the dot's centre, of wide
    markers the centroid of its image; dot_xyz: (K, 3) m; dot_state: (K,) uint8,
    NON_CONTACT, STICKING or SLIPPING over the interval since the previous frame; outlines, holes: lists of (n, 3) arrays, m;
    area: m^2, without holes; centroid (3,) m and normal (3,) of the region, NaN without contact; contacts: list of Touch;
    slip_state: of slip_state_of; slipping_fraction: of the contact area;
    velocity: (6,) m/s and rad/s, slip twist of the object relative to the skin, at the sensor frame's origin, 0 without slip, NaN without
    contact; rotation_center: (3,) m, centre of rotation of that twist in the contact plane, NaN for pure translation;
    motion: (6,) m and rad, displacement of the object since the previous frame, at the sensor frame's origin, NaN without contact;
    pose: (6,), the same since the frame in which it touched;
    wrench: (6,) N and N m, of the object on the sensor at the sensor frame's origin; pressure: Pa, gauge pressure inside the skin;
    dot_gap: (K,) m, distance of each dot from the object, inf without contact, None if unknown;
    tip: (3,) m, lowest point of a round tip that is near, whether it touches or not, NaN of none.
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
    """One frame of a scene: image (height, width, 3) uint8 BGR and its truth."""

    image: np.ndarray
    truth: TruthFrame


class FramesInOrder(Generic[Known]):
    """What is known of a scene's frames, each computed after those before it and kept. Subclasses set frames, those of a round, and _known,
    a list, and implement _next, which computes what comes next."""

    frames: int
    _known: list[Known]

    def observe(self, number: int) -> Known:
        """What is known of the frame number; the scene repeats."""
        while self.observe_ahead(number % self.frames):
            pass
        return self._known[number % self.frames]

    def observe_ahead(self, number: int) -> bool:
        """Compute one frame that is not known yet; False if those up to number and one round are known."""
        ahead = len(self._known) <= min(number, self.frames - 1)
        if ahead:
            self._known.append(self._next())
        return ahead
