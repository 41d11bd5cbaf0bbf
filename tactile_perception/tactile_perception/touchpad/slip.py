# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slip of the object over the sensor: its state, velocity and centre, from the slipping dots and the object's displacement over them."""
from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from ..common.estimates import NONE, ContactEstimate, SlipEstimate, next_state, planar_twist
from ..core.errors import BadArgument, BadFrame
from .constants import TOUCHPAD
from .region import ContactDots


class SlipEstimator:
    """Estimates slip frame by frame."""

    def __init__(self):
        self.reset()

    def reset(self) -> None:
        """Drop all earlier frames."""
        self._state, self._stamp = NONE, -np.inf

    def process(self, dots: ContactDots, contacts: list[ContactEstimate], displacements: np.ndarray, stamp_s: float,
                objects: Sequence = ()) -> SlipEstimate:
        """Estimate slip in one frame.

        The twist is that over the largest contact with enough known displacements.

        Parameters
        ----------
        dots : ContactDots
            The N dots of the frame.
        contacts : list of ContactEstimate
            The contacts of the frame, largest first.
        displacements : ndarray, shape (N, 2)
            Displacement in m, along x and y, of the object over each dot since the previous frame; NaN if unknown.
        stamp_s : float
            Exposure time in s.
        objects : sequence of TouchingObject, optional
            The objects in contact, from which the confidence of the state follows.

        Returns
        -------
        SlipEstimate
            State, slipping fraction, velocities and centre of rotation.

        Raises
        ------
        BadFrame
            If the stamp is not later than the last.
        BadArgument
            If the displacements are not of the same number of dots.
        """
        if np.shape(displacements) != (len(dots.ids), 2):
            raise BadArgument(f'slip: displacements must have shape ({len(dots.ids)}, 2), got {np.shape(displacements)}')
        if not self._stamp < stamp_s < np.inf:
            raise BadFrame(f'slip: stamp {stamp_s} s is not later than the last; frame skipped')
        interval, self._stamp = stamp_s - self._stamp if math.isfinite(self._stamp) else np.nan, stamp_s
        state = np.asarray(dots.state)
        if not (state > 0).any():
            self._state = NONE
            return SlipEstimate(confidence=slip_confidence(NONE, objects))
        slipping = np.flatnonzero(state == 2)
        fraction = len(slipping) / np.count_nonzero(state)
        previous, self._state = self._state, next_state(self._state, fraction)
        position, velocity = dots.xyz[slipping], displacements[slipping] / interval
        estimate = SlipEstimate(self._state, fraction, x=position[:, 0], y=position[:, 1], vx=velocity[:, 0], vy=velocity[:, 1],
                                confidence=slip_confidence(self._state, objects, previous))
        if self._state == NONE:
            estimate.linear, estimate.angular = np.zeros(3), np.zeros(3)
            return estimate
        for contact in contacts:
            known = contact.members[slipping] & np.isfinite(velocity).all(axis=1)
            if np.count_nonzero(known) >= TOUCHPAD.min_dots_for_twist:
                linear, turn, centre = planar_twist(position[known, :2], velocity[known])
                estimate.linear, estimate.angular = np.array([*linear, 0.0]), np.array([0.0, 0.0, turn])
                if not math.isnan(centre[0]):
                    estimate.rotation_center = np.array([*centre, position[known, 2].mean()])
                break
        return estimate


def slip_confidence(state: int, objects: Sequence, previous: int = NONE) -> float:
    """Probability of a state of slip from the mode probabilities of each of the objects (TouchingObject).

    previous: state of the previous frame, from which the hysteresis starts. NaN without an object.
    """
    judged = [one for one in objects if one.count][:TOUCHPAD.max_objects]
    if not judged:
        return np.nan
    count, right = sum(one.count for one in judged), 0.0
    slipping = [[one.count * share for share in one.slipping] for one in judged]  # dots of each object, in each of its modes
    for odds, dots in zip(product(*(one.odds for one in judged)), product(*slipping)):
        right += math.prod(odds) * (next_state(previous, sum(dots) / count) == state)
    return TOUCHPAD.sure_but_wrong / 2 + (1 - 1.5 * TOUCHPAD.sure_but_wrong) * right  # the two other states are equally likely
