# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slip of the object over the sensor, from the states and motions of the dots."""
from __future__ import annotations

from collections import deque

import numpy as np

from ...common.estimates import GROSS, NONE, ContactEstimate, SlipEstimate
from ...common.slip import STILL_GROSS, next_state, planar_twist
from ...errors import BadArgument, BadFrame
from .region import ContactDots
from .object_motion import MotionEstimate

_FEWEST = 6  # dots that determine a twist or a centre; chosen
_SIGNIFICANT = 6.0  # standard deviations above which a contact's drift is used: 17 % of error each
_TIP = 0.15e-3  # m, standard deviation of a contact's place: that of a face or an edge is larger; chosen
_STEADY = 0.6  # largest change of a drift within the window, of the drift; chosen
_WINDOW_S = 0.15  # s, over which a contact's drift is measured; chosen


class SlipEstimator:
    """Slip frame by frame.

    While some dots of a contact stick, slip is measured relative to their motion. In gross slip it is the drift of the contact over the
    dots, where it is steady and known to a sixth: that of a curved tip, whose lowest point follows it. The border of a face lags behind it,
    so its speed stays unknown. A rotation in place is unobservable; its centre follows from friction.
    """

    def __init__(self):
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        self._state = NONE
        self._past: deque[tuple[float, dict[int, tuple[np.ndarray, np.ndarray, np.ndarray]]]] = deque()

    def process(self, dots: ContactDots, contacts: list[ContactEstimate], motion: MotionEstimate, stamp_s: float) -> SlipEstimate:
        """Slip in one frame. Raises BadFrame for a stamp that is not later than the last, BadArgument where motion is of another frame."""
        if len(motion.slip) != len(dots.ids):
            raise BadArgument(f'slip: motion has {len(motion.slip)} dots, the frame {len(dots.ids)}')
        if not np.isfinite(stamp_s) or (self._past and stamp_s <= self._past[-1][0]):
            raise BadFrame(f'slip: stamp {stamp_s} s is not later than the last; frame skipped')
        self._remember(dots, contacts, stamp_s)
        state = np.asarray(dots.state)
        if not (state > 0).any():
            self._state = NONE
            return SlipEstimate()
        slipping = np.flatnonzero(state == 2)
        fraction = len(slipping) / np.count_nonzero(state)
        self._state = next_state(self._state, fraction)
        place = dots.xyz[slipping]
        estimate = SlipEstimate(self._state, fraction, x=place[:, 0], y=place[:, 1])
        whole = [contact for contact in contacts if _slips_grossly(dots, contact)]
        several = sum(contact.members.sum() >= _FEWEST for contact in whole) > 1
        centre = None if several or dots.force is None else friction_centre(place[:, :2], dots.force[slipping, :2])
        velocity, drift = _relative_velocity(motion), np.full(2, np.nan)
        for contact in whole:
            here = self._gross_velocity(dots, contact)
            velocity[contact.members] = here
            drift = drift if np.isfinite(drift).all() else here
        velocity = velocity[slipping]
        estimate.vx, estimate.vy = velocity.T
        self._add_twist(estimate, place, velocity, drift, centre)
        return estimate

    def _remember(self, dots: ContactDots, contacts: list[ContactEstimate], stamp_s: float) -> None:
        """Keep places and dots of the contacts that slip grossly."""
        places = {contact.id: (contact.position[:2], dots.ids[contact.members], dots.xyz[contact.members, :2]) for contact in contacts
                  if _slips_grossly(dots, contact)}
        self._past.append((stamp_s, places))
        while self._past[0][0] < stamp_s - _WINDOW_S * (1 + 1e-6):
            self._past.popleft()

    def _gross_velocity(self, dots: ContactDots, contact: ContactEstimate) -> np.ndarray:
        """(2,) m/s of the object over the surface at the dots of a contact in gross slip, from its drift; NaN if it turns or may turn."""
        centre = None if dots.force is None else friction_centre(dots.xyz[contact.members, :2], _drags(dots, contact))
        sigma = np.sqrt(np.trace(contact.position_covariance[:2, :2]))
        if centre is None or np.isfinite(centre).all() or sigma > _TIP:
            return np.full(2, np.nan)
        drift = self._drift(contact.id)
        return drift if np.linalg.norm(drift) > _SIGNIFICANT * np.sqrt(2) * sigma / _WINDOW_S else np.full(2, np.nan)

    def _drift(self, number: int) -> np.ndarray:
        """(2,) m/s of a contact relative to its dots; NaN before it has slipped grossly for half the window, and where it is not steady."""
        seen = []
        for stamp, places in self._past:
            seen = [*seen, (stamp, *places[number])] if number in places else []
        if len(seen) < 3 or seen[-1][0] - seen[0][0] < 0.5 * _WINDOW_S:
            return np.full(2, np.nan)
        stamps, places = np.array([stamp for stamp, *_ in seen]), np.array([place for _, place, *_ in seen])
        middle = len(seen) // 2
        early, late = (_slope(stamps[part], places[part]) for part in (slice(None, middle + 1), slice(middle, None)))
        # Theil-Sen slope: robust to the one step of the position when the object's shape becomes known.
        first, last = np.triu_indices(len(seen), 1)
        speed = np.median((places[last] - places[first]) / (stamps[last] - stamps[first])[:, None], axis=0)
        (_, _, before_id, before), (_, _, now_id, now) = seen[0], seen[-1]
        _, at, then = np.intersect1d(now_id, before_id, assume_unique=True, return_indices=True)
        if len(at):
            speed = speed - np.mean(now[at] - before[then], axis=0) / (stamps[-1] - stamps[0])
        steady = np.linalg.norm(late - early) < _STEADY * np.linalg.norm(speed)
        return speed if steady else np.full(2, np.nan)

    def _add_twist(self, estimate: SlipEstimate, place: np.ndarray, velocity: np.ndarray, drift: np.ndarray,
                   centre: np.ndarray | None) -> None:
        """Set the planar twist of the slipping dots at place (S, 3), m, and its centre: from velocity (S, 2), in gross slip from the
        drift (2,) of the largest contact where it is known; else the centre from friction."""
        if self._state == NONE:
            estimate.linear, estimate.angular = np.zeros(3), np.zeros(3)
            return
        known = np.isfinite(velocity).all(axis=1)
        if self._state == GROSS:
            if np.isfinite(drift).all():  # known only in a translation
                estimate.linear, estimate.angular, centre = np.array([*drift, 0.0]), np.zeros(3), None
        elif known.sum() >= _FEWEST:
            linear, turn, centre = planar_twist(place[known, :2], velocity[known])
            estimate.linear, estimate.angular = np.array([*linear, 0.0]), np.array([0.0, 0.0, turn])
        if centre is not None and np.isfinite(centre).all():
            estimate.rotation_center = np.array([*centre, place[:, 2].mean()])


def _slips_grossly(dots: ContactDots, contact: ContactEstimate) -> bool:
    return bool(np.mean(np.asarray(dots.state)[contact.members] == 2) >= STILL_GROSS)


def _drags(dots: ContactDots, contact: ContactEstimate) -> np.ndarray:
    """(M, 2) N: tangential forces on the dots of a contact, across its normal."""
    force = dots.force[contact.members]
    return (force - np.outer(force @ contact.normal, contact.normal))[:, :2]


def _slope(stamps: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(2,) m/s between the first and the last of places (T, 2), m, at stamps (T,), s."""
    return (places[-1] - places[0]) / (stamps[-1] - stamps[0])


def _relative_velocity(motion: MotionEstimate) -> np.ndarray:
    """(N, 2) m/s of the object over the surface at each dot, relative to the sticking dots."""
    return np.full((len(motion.slip), 2), np.nan) if motion.motion is None else -motion.slip[:, :2] / motion.interval


def friction_centre(place: np.ndarray, force: np.ndarray) -> np.ndarray | None:
    """(2,) m: rotation centre of the friction forces force (S, 2) at place (S, 2), NaN for a translation; None if undetermined.

    Friction on the surface points along the object's velocity, so both fields have the same centre.
    """
    if len(place) < _FEWEST or not force.any() or (place == place[0]).all():
        return None
    return planar_twist(place, force)[2]
