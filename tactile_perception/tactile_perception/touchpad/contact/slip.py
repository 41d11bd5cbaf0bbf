# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slip of the object over the sensor, from the states and motions of the dots."""
from __future__ import annotations

import math

import numpy as np

from ...common.estimates import GROSS, NONE, STILL_GROSS, ContactEstimate, SlipEstimate, next_state, planar_twist
from ...errors import BadArgument, BadFrame
from .region import ContactDots
from .object_motion import MotionEstimate
from .travel import ContactTravel

_FEWEST = 6  # dots that determine a twist or a centre; chosen
_LIFTED = 1e-3  # m/s, above which an object that rises is lifted: its dots spring back, none tells how it moves; chosen


class SlipEstimator:
    """Slip frame by frame.

    While some dots of a contact stick, slip is measured relative to their motion. In gross slip it is the motion that the object last had
    when it held dots, for some time; else the contact's motion over the dots, known of curved tips that move evenly. A rotation in place is
    unobservable; its centre follows from friction. Of an object that is lifted no velocity is known.
    """

    def __init__(self):
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        self._state = NONE
        self._stamp, self._travel = -np.inf, ContactTravel()
        self._depths: dict[int, float] = {}  # m, of the contacts in the last frame, by id

    def process(self, dots: ContactDots, contacts: list[ContactEstimate], motion: MotionEstimate, stamp_s: float,
                slides: np.ndarray | None = None) -> SlipEstimate:
        """Slip in one frame. slides: (N, 2) m, way over each dot since the last frame in gross slip, NaN or None: unknown. Raises BadFrame
        for a stamp that is not later than the last, BadArgument where motion is of another frame."""
        if len(motion.slip) != len(dots.ids):
            raise BadArgument(f'slip: motion has {len(motion.slip)} dots, the frame {len(dots.ids)}')
        if not self._stamp < stamp_s < np.inf:
            raise BadFrame(f'slip: stamp {stamp_s} s is not later than the last; frame skipped')
        interval, self._stamp = stamp_s - self._stamp, stamp_s
        self._travel.add(dots, contacts, stamp_s)
        before, self._depths = self._depths, {contact.id: contact.depth for contact in contacts}
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
        several = sum(np.count_nonzero(contact.members) >= _FEWEST for contact in whole) > 1
        centre = None if several or dots.force is None else friction_centre(place[:, :2], dots.force[slipping, :2])
        velocity, drift = _relative_velocity(motion, slipping), np.full(2, np.nan)
        for contact in contacts:
            if before.get(contact.id, np.nan) - contact.depth > _LIFTED * interval:
                velocity[contact.members[slipping]] = np.nan
        for contact in whole:
            here = self._gross_velocity(dots, contact, None if slides is None else slides[contact.members].mean(axis=0) / interval)
            velocity[contact.members[slipping]] = here
            drift = here if math.isnan(drift[0]) else drift
        estimate.vx, estimate.vy = velocity.T
        self._add_twist(estimate, place, velocity, drift, centre)
        return estimate

    def _gross_velocity(self, dots: ContactDots, contact: ContactEstimate, known: np.ndarray | None) -> np.ndarray:
        """(2,) m/s of the object over the surface at the dots of a contact in gross slip: known (2,), as it last moved with its dots, where
        it is known, else that of its tip; NaN if it turns or may turn."""
        if known is not None and not math.isnan(known[0]):
            return known
        centre = None if dots.force is None else friction_centre(dots.xyz[contact.members, :2], _drags(dots, contact))
        if centre is None or not math.isnan(centre[0]):
            return np.full(2, np.nan)
        return self._travel.velocity(contact.id)

    def _add_twist(self, estimate: SlipEstimate, place: np.ndarray, velocity: np.ndarray, drift: np.ndarray,
                   centre: np.ndarray | None) -> None:
        """Set the planar twist of the slipping dots at place (S, 3), m, and its centre: from velocity (S, 2), in gross slip from the
        drift (2,) of the largest contact where it is known; else the centre from friction."""
        if self._state == NONE:
            estimate.linear, estimate.angular = np.zeros(3), np.zeros(3)
            return
        known = np.isfinite(velocity).all(axis=1)
        if self._state == GROSS:
            if not math.isnan(drift[0]):  # known only in a translation
                estimate.linear, estimate.angular, centre = np.array([*drift, 0.0]), np.zeros(3), None
        elif known.sum() >= _FEWEST:
            linear, turn, centre = planar_twist(place[known, :2], velocity[known])
            estimate.linear, estimate.angular = np.array([*linear, 0.0]), np.array([0.0, 0.0, turn])
        if centre is not None and not math.isnan(centre[0]):
            estimate.rotation_center = np.array([*centre, place[:, 2].mean()])


def _slips_grossly(dots: ContactDots, contact: ContactEstimate) -> bool:
    state = np.asarray(dots.state)[contact.members]
    return np.count_nonzero(state == 2) >= STILL_GROSS * len(state)


def _drags(dots: ContactDots, contact: ContactEstimate) -> np.ndarray:
    """(M, 2) N: tangential forces on the dots of a contact, across its normal."""
    force = dots.force[contact.members]
    return force[:, :2] - (force @ contact.normal)[:, None] * contact.normal[:2]


def _relative_velocity(motion: MotionEstimate, slipping: np.ndarray) -> np.ndarray:
    """(S, 2) m/s of the object over the surface at the dots slipping (S,), relative to the sticking dots."""
    return np.full((len(slipping), 2), np.nan) if motion.motion is None else -motion.slip[slipping, :2] / motion.interval


def friction_centre(place: np.ndarray, force: np.ndarray) -> np.ndarray | None:
    """(2,) m: rotation centre of the friction forces force (S, 2) at place (S, 2), NaN for a translation; None if undetermined.

    Friction on the surface points along the object's velocity, so both fields have the same centre.
    """
    if len(place) < _FEWEST or not force.any():
        return None
    _, turn, centre = planar_twist(place, force)
    return None if math.isnan(turn) else centre
