# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slip of the object over the sensor: its state, velocity and centre, from the dots that slip and the object's way over them."""
from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from ..common.estimates import NONE, ContactEstimate, SlipEstimate, next_state, planar_twist
from ..errors import BadArgument, BadFrame
from .region import ContactDots

_FEWEST = 6  # dots that tell a twist; chosen: twice the three that determine it
# Share of the frames of whose state of slip the model is sure and wrong: measured on random scenes (docs/stick_slip.md).
_WRONG = 0.09
_MOST = 3  # objects, largest first, whose modes count in the probability of slip: it takes time as four to the power of it


class SlipEstimator:
    """Slip frame by frame."""

    def __init__(self):
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        self._state, self._stamp = NONE, -np.inf

    def process(self, dots: ContactDots, contacts: list[ContactEstimate], ways: np.ndarray, stamp_s: float) -> SlipEstimate:
        """Slip in one frame. ways: (N, 2) m, of the object over each dot since the last frame along x and y, NaN: unknown.

        The twist is that over the largest contact with enough known ways. Raises BadFrame for a stamp that is not later than the last,
        BadArgument for ways of another frame.
        """
        if np.shape(ways) != (len(dots.ids), 2):
            raise BadArgument(f'slip: ways must be ({len(dots.ids)}, 2), two for each dot, got {np.shape(ways)}')
        if not self._stamp < stamp_s < np.inf:
            raise BadFrame(f'slip: stamp {stamp_s} s is not later than the last; frame skipped')
        interval, self._stamp = stamp_s - self._stamp if math.isfinite(self._stamp) else np.nan, stamp_s
        state = np.asarray(dots.state)
        if not (state > 0).any():
            self._state = NONE
            return SlipEstimate()
        slipping = np.flatnonzero(state == 2)
        fraction = len(slipping) / np.count_nonzero(state)
        self._state = next_state(self._state, fraction)
        place, velocity = dots.xyz[slipping], ways[slipping] / interval
        estimate = SlipEstimate(self._state, fraction, x=place[:, 0], y=place[:, 1], vx=velocity[:, 0], vy=velocity[:, 1])
        if self._state == NONE:
            estimate.linear, estimate.angular = np.zeros(3), np.zeros(3)
            return estimate
        for contact in contacts:
            known = contact.members[slipping] & np.isfinite(velocity).all(axis=1)
            if np.count_nonzero(known) >= _FEWEST:
                linear, turn, centre = planar_twist(place[known, :2], velocity[known])
                estimate.linear, estimate.angular = np.array([*linear, 0.0]), np.array([0.0, 0.0, turn])
                if not math.isnan(centre[0]):
                    estimate.rotation_center = np.array([*centre, place[known, 2].mean()])
                break
        return estimate


def slip_confidence(state: int, objects: Sequence) -> float:
    """Probability of a state of slip, by the probabilities of what each of the objects (_core.TouchingObject) does; NaN without one."""
    judged = [one for one in objects if one.count][:_MOST]
    if not judged:
        return np.nan
    count, right = sum(one.count for one in judged), 0.0
    for modes in product(range(4), repeat=len(judged)):
        fraction = sum(one.count * one.slipping[mode] for one, mode in zip(judged, modes)) / count
        right += math.prod(one.odds[mode] for one, mode in zip(judged, modes)) * (next_state(NONE, fraction) == state)
    return _WRONG / 2 + (1 - 1.5 * _WRONG) * right  # each of the two other states is as likely
