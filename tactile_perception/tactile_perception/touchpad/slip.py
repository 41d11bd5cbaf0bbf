# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which dots stick or slip, how the object moves, and its slip over the sensor."""
from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ..common.estimates import GROSS, NONE, STILL_GROSS, ContactEstimate, SlipEstimate, next_state, planar_twist
from ..common.rigid_motion import RigidFit, fit_rigid_robust
from ..errors import BadArgument, BadFrame, DegenerateFit
from .region import ContactDots

_FEWEST = 6  # dots that tell a motion, a twist or a centre; chosen: twice the three that determine it

_MOST = 3  # objects, largest first, whose modes count in the probability of slip: it takes time as four to the power of it


@dataclass(frozen=True)
class MotionEstimate:
    """motion: of the object over interval, s, of the largest region with a known motion if there are more, None and NaN when unknown;
    slip: (N, 3) m, of each dot over its own object in that time, NaN for dots that are free or were not seen before, and where the motion
    is unknown.
    """

    motion: RigidFit | None
    interval: float
    slip: np.ndarray


class ObjectMotion:
    """The object's motion over the last interval_s, s, frame by frame, on a rows x columns grid.

    A robust rigid fit to the dots of each separate region that stuck during the whole interval. In gross slip no dot sticks and the motion
    is unknown.
    """

    def __init__(self, rows: int, columns: int, interval_s: float = 0.1):
        if not 0 < interval_s < np.inf:
            raise BadArgument(f'object motion: interval_s must be positive, got {interval_s}')
        self.rows, self.columns, self.interval_s = rows, columns, interval_s
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        self._past: deque[tuple[float, np.ndarray, np.ndarray]] = deque()
        self._stuck = np.zeros(self.rows * self.columns, np.int64)  # frames up to the last in which each dot stuck without a break

    def process(self, dots: ContactDots, stamp_s: float, regions: list[np.ndarray] | None = None) -> MotionEstimate:
        """Motion up to this frame. regions: the members (N,) bool of each separate region, largest first; None: all dots are one region's.

        Raises BadFrame for a stamp that is not later than the last.
        """
        if not np.isfinite(stamp_s) or (self._past and stamp_s <= self._past[-1][0]):
            raise BadFrame(f'object motion: stamp {stamp_s} s is not later than the last; frame skipped')
        states = np.zeros(self.rows * self.columns, np.uint8)
        states[dots.ids] = dots.state
        places = np.full((self.rows * self.columns, 3), np.nan)
        places[dots.ids] = dots.xyz
        self._past.append((stamp_s, places, states))
        self._stuck = (self._stuck + 1) * (states == 1)
        while len(self._past) > 2 and self._past[1][0] <= stamp_s - self.interval_s * (1 - 1e-6):
            self._past.popleft()
        return self._estimate(dots, stamp_s, [np.ones(len(dots.ids), bool)] if regions is None else regions)

    def _estimate(self, dots: ContactDots, stamp_s: float, regions: list[np.ndarray]) -> MotionEstimate:
        unknown = MotionEstimate(None, np.nan, np.full((len(dots.ids), 3), np.nan))
        since, before, first = self._past[0]
        if len(self._past) < 2 or not first.any():
            return unknown
        known = (first[dots.ids] > 0) & (np.asarray(dots.state) > 0)
        chosen, first_motion, slip = known & (self._stuck[dots.ids] >= len(self._past) - 1), None, unknown.slip
        before = before[dots.ids]
        for members in regions:
            motion = _shared_motion(before, dots, chosen & members)
            if motion is not None:
                first_motion = first_motion or motion
                moving = known & members
                slip[moving] = dots.xyz[moving] - motion.apply(before[moving])
        return MotionEstimate(first_motion, stamp_s - since, slip) if first_motion else unknown


def _shared_motion(before: np.ndarray, dots: ContactDots, sticking: np.ndarray) -> RigidFit | None:
    """The motion that at least half of the sticking (N,) dots share; None without such a motion or if they do not determine it."""
    if np.count_nonzero(sticking) < _FEWEST:
        return None
    before, now = before[sticking], dots.xyz[sticking]
    try:
        motion = fit_rigid_robust(before, now, np.sqrt(2) * dots.sigma)
    except DegenerateFit:
        return None
    return motion if np.count_nonzero(motion.weights) >= max(_FEWEST, len(before) / 2) else None


_LIFTED = 1e-3  # m/s, above which an object that rises is lifted: its dots spring back, none tells how it moves; chosen


class SlipEstimator:
    """Slip frame by frame.

    While some dots of a contact stick, slip is measured relative to their motion. In gross slip it is the motion that the object last had
    when it held dots, for a second; then it is unknown. A rotation in place is unobservable; its centre follows from friction. Of an object
    that is lifted no velocity is known.
    """

    def __init__(self):
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        self._state = NONE
        self._stamp = -np.inf
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
            here = np.full(2, np.nan) if slides is None else slides[contact.members].mean(axis=0) / interval
            velocity[contact.members[slipping]] = here
            drift = here if math.isnan(drift[0]) else drift
        estimate.vx, estimate.vy = velocity.T
        self._add_twist(estimate, place, velocity, drift, centre)
        return estimate

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


def _relative_velocity(motion: MotionEstimate, slipping: np.ndarray) -> np.ndarray:
    """(S, 2) m/s of the object over the surface at the dots slipping (S,), relative to the sticking dots."""
    return np.full((len(slipping), 2), np.nan) if motion.motion is None else -motion.slip[slipping, :2] / motion.interval


def slip_confidence(state: int, objects: Sequence) -> float:
    """Probability of a state of slip, by the probabilities of what each of the objects (_core.TouchingObject) does; NaN without one."""
    judged = [one for one in objects if one.count][:_MOST]
    if not judged:
        return np.nan
    count, right = sum(one.count for one in judged), 0.0
    for modes in product(range(4), repeat=len(judged)):
        fraction = sum(one.count * one.slipping[mode] for one, mode in zip(judged, modes)) / count
        right += math.prod(one.odds[mode] for one, mode in zip(judged, modes)) * (next_state(NONE, fraction) == state)
    return right


def friction_centre(place: np.ndarray, force: np.ndarray) -> np.ndarray | None:
    """(2,) m: rotation centre of the friction forces force (S, 2) at place (S, 2), NaN for a translation; None if undetermined.

    Friction on the surface points along the object's velocity, so both fields have the same centre.
    """
    if len(place) < _FEWEST or not force.any():
        return None
    _, turn, centre = planar_twist(place, force)
    return None if math.isnan(turn) else centre
