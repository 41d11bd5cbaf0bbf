# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""State of each dot (free, sticking, slipping) from loads and motions, without a known friction coefficient.

Each separate object has a motion of its own; a dot that lags behind it slips. The kernel, src/touchpad/contact/stick_slip.cpp, says how
objects begin, slide, slow down, rest and are lifted. Here is what is kept from frame to frame, and how an object in gross slip moves on.
"""
from __future__ import annotations

import math

import numpy as np

from ... import _core
from .loads import DotLoads

NON_CONTACT, STICKING, SLIPPING = 0, 1, 2
_SMOOTHING = 0.2  # weight of a new value in the running mean of noise; chosen
_CALMEST = 5  # the quantile 1/5 of the motions is used as noise, of which it is 0.668 standard deviations (2D Gaussian: sqrt(-2 ln 0.8))
# How many numbers describe an object, and which of them tell whether its motion is known, whether it slips grossly, rests after that, was
# not found in the last frame, and its motion in a frame, m: see the kernel.
_NUMBERS, _MOVES, _GROSS, _RESTS, _LOST, _TWIST = 27, 1, 2, 14, 26, 5
_LONGEST = 30  # frames for which an object in gross slip is taken to move on as before; chosen: a second
# Parts of its speed: largest motion of its dots as it turns, largest along the sensor's axis as it is not lifted, and smallest over dots
# that it does not take along. Chosen.
_TURNS, _STEEP, _FREE = 0.1, 0.3, 0.3


class StickSlipTracker:
    """Classifies the dots of a rows x columns grid frame by frame; origin: (3,) m, camera centre.

    tolerance: m, lag of a sticking dot behind the object in a frame; noise: m, standard deviation of a dot's motion across its ray, an
    initial value: it is measured while nothing touches. friction: coefficient in the last slip, NaN before the first.
    """

    def __init__(self, rows: int, columns: int, origin: np.ndarray, tolerance: float = 10e-6, noise: float = 2e-6):
        self.shape, self.origin = (rows, columns), np.asarray(origin, float)
        self.tolerance, self.noise = tolerance, noise
        self.depth_noise = 2 * tolerance
        self.reset()

    def reset(self):
        """Forget all frames."""
        size = self.shape[0] * self.shape[1]
        self._last = np.zeros((size, 3)), np.zeros(size, bool), np.zeros(size)  # places, seen, scores
        self._forget_objects()
        self.friction = np.nan

    def _forget_objects(self) -> None:
        self._held, self._objects = np.zeros(len(self._last[1]), np.int64), np.zeros((0, _NUMBERS))
        self._age, self._moved = np.zeros(len(self._held), np.int64), np.zeros((len(self._held), 3))

    def update(self, state: DotLoads, score: np.ndarray) -> np.ndarray:
        """States (K,) uint8 in this frame; score (K,): above 0.5 in contact."""
        if not (score > .5).any():
            self.observe_free(state.xyz, state.seen)
            return np.zeros(len(score), np.uint8)
        states, self._held, self._objects, self.depth_noise, self.friction = _core.stick_slip(
            self._last, (state.xyz, score, state.seen, state.normal, state.force), self._held, self._objects, self.origin,
            rows=self.shape[0], columns=self.shape[1], tolerance=self.tolerance, noise=self.noise, depth_noise=self.depth_noise,
            friction=self.friction)
        self._moved = state.xyz - self._last[0]
        self._last = state.xyz, state.seen, score
        self._age = np.where(self._held > 0, self._age + 1, 0)
        for dots, thing in self._held_objects():
            self._age[dots] = self._age[dots].max() if thing[_GROSS] or thing[_RESTS] else 0
        return states

    def _held_objects(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """The dots (K,) bool that hold each object, and its numbers."""
        return [(self._held == number, thing) for number, thing in enumerate(self._objects, 1)]

    def slides(self) -> np.ndarray:
        """(K, 2) m: way in the last frame over each dot of an object in gross slip that neither turns nor is lifted, as it last moved with
        its dots, _LONGEST frames before at most; NaN: unknown. Standard deviation: a third, since it may have changed its speed."""
        ways = np.full((len(self._held), 2), np.nan)
        for dots, thing in self._held_objects():
            if thing[_GROSS] and thing[_MOVES] and self._age[dots].max() <= _LONGEST:
                ways[dots] = self._way(dots, thing[_TWIST:_TWIST + 6])
        return ways

    def _way(self, dots: np.ndarray, twist: np.ndarray) -> np.ndarray:
        """(2,) m: way over dots (K,) bool of an object that moves by twist (6,); NaN if it turns or rises, or if the dots move along."""
        place, speed = self._last[0][dots, :2], math.hypot(*twist[:2])
        way = twist[:2] - self._moved[dots, :2].mean(axis=0)
        turns = abs(twist[5]) * math.sqrt(place.var(axis=0).sum()) > _TURNS * speed
        lifted = abs(twist[2]) > _STEEP * speed
        return np.full(2, np.nan) if turns or lifted or not math.hypot(*way) > _FREE * speed else way

    def observe_free(self, xyz: np.ndarray, seen: np.ndarray) -> None:
        """A frame without contact: dots at xyz (K, 3) m; seen: (K,) bool. Forgets the objects, but in the first such frame, and updates
        the noise from the motions."""
        both = seen & self._last[1]
        if not len(self._objects) and both.any():
            moved = _across_rays(self._last[0], xyz, self.origin)[both]
            # a low quantile: a touch below the detection limit moves many dots
            here = np.partition(moved, len(moved) // _CALMEST)[len(moved) // _CALMEST] / 0.668
            if here > 0:
                self.noise += (_SMOOTHING if here < self.noise else _SMOOTHING / 4) * (here - self.noise)
        self._last = xyz, seen, np.zeros(len(seen))
        if self._objects[:, _LOST].all():
            self._forget_objects()
        self._objects[:, _LOST] = 1


def _across_rays(before: np.ndarray, after: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """Lengths (N,), m, of the motions from before to after (N, 3) m across the rays from origin (3,)."""
    rays = (before + after) / 2 - origin
    moved = after - before
    along = np.einsum('ij,ij->i', moved, rays)
    square = np.einsum('ij,ij->i', moved, moved) - along * along / np.einsum('ij,ij->i', rays, rays)
    return np.sqrt(np.maximum(square, 0))
