# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tracking of touches: persistent ids and a Kalman filter for each touch (kernel follow_touches: src/press/touch_filter.cpp)."""
from __future__ import annotations

from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from .. import _core
from ..errors import BadArgument, BadFrame
from .estimate import TouchEstimate

# Standard deviation of a touch's acceleration, m/s^2: a hand that is moved starts and stops at 0.1 m/s within 50 ms. Chosen.
ACCELERATION = 2.0
_GATE = 20.0  # squared Mahalanobis distance: exceeded once in 2000 frames (chi-square, four degrees of freedom)
_SPEED = 0.3  # m/s, standard deviation of a new touch's velocity. Chosen
_LEAST = 1e-5  # m: least standard deviation of a measurement, which keeps covariances regular. Chosen
_MISSED = 3  # consecutive missed frames after which a track ends. Chosen


@dataclass(frozen=True)
class Touch:
    """A touch with its id, which is never reused."""

    id: int
    estimate: TouchEstimate


class TouchTracker:
    """Assigns ids to touches and filters them.

    filtered: False returns each frame's own estimate. The filter's model of place and depth is constant velocity with white acceleration
    (standard deviation ACCELERATION), for any frame interval. A touch at constant velocity has no lag; a step within the gate is
    followed to 90 % in 20 to 35 ms (sigma 0.1 mm, 30 to 200 frames per second).
    """

    def __init__(self, filtered: bool = True):
        self._filtered = filtered
        self._next = 1
        self.reset()

    def reset(self) -> None:
        """Drop all tracks; ids are not reused."""
        self._tracks: list[_Track] = []
        self._stamp_s: float | None = None

    def check(self, stamp_s: float) -> None:
        """Raise BadFrame for a stamp that is not later than the last."""
        if not np.isfinite(stamp_s) or (self._stamp_s is not None and stamp_s <= self._stamp_s):
            raise BadFrame(f'touches: stamp {stamp_s} s is not later than the last; frame skipped')

    def process(self, estimates: list[TouchEstimate], stamp_s: float) -> list[Touch]:
        """The touches of a frame with their ids. Raises BadFrame for a stamp that is not later than the last."""
        self.check(stamp_s)
        elapsed = 0.0 if self._stamp_s is None else stamp_s - self._stamp_s
        self._stamp_s = stamp_s
        if not estimates and not self._tracks:
            return []
        values, spreads = _measurements(estimates)
        continued = self._follow(values, spreads, elapsed)
        kept = [self._tracks[k] if k >= 0 else self._new(value, spread) for k, value, spread in zip(continued, values, spreads)]
        for track in kept:
            track.missed = 0
        touches = [Touch(track.id, track.filtered(estimate) if self._filtered else estimate) for track, estimate in zip(kept, estimates)]
        for track in self._tracks:
            if track not in kept and track.missed < _MISSED:
                track.missed += 1
                kept.append(track)
        self._tracks = kept
        return touches

    def _follow(self, values: np.ndarray, spreads: np.ndarray, elapsed: float) -> list[int]:
        """Predict and update the tracks; the one that each measurement continues, -1 for none."""
        if not self._tracks:
            return [-1] * len(values)
        states, covariances = (np.array([getattr(track, name) for track in self._tracks]) for name in ('state', 'covariance'))
        states, covariances, continued = _core.follow_touches(states, covariances, values, spreads, elapsed=elapsed,
                                                              acceleration=ACCELERATION, gate=_GATE)
        for track, state, covariance in zip(self._tracks, states, covariances):
            track.state, track.covariance = state, covariance
        return continued.tolist()

    def _new(self, value: np.ndarray, spread: np.ndarray) -> _Track:
        self._next += 1
        covariance = _SPEED**2 * np.eye(8)
        covariance[:4, :4] = spread
        return _Track(self._next - 1, np.concatenate([value, np.zeros(4)]), covariance)


@dataclass(eq=False)
class _Track:
    """One touch. state: (8,) place and depth, m, and their velocities; covariance: (8, 8); missed: consecutive frames."""

    id: int
    state: np.ndarray
    covariance: np.ndarray
    missed: int = 0

    def filtered(self, estimate: TouchEstimate) -> TouchEstimate:
        """The estimate with filtered place, depth and covariance."""
        place = self.covariance[:3, :3]
        return replace(estimate, position=self.state[:3].copy(), depth=max(float(self.state[3]), 0.0),
                       covariance=0.5 * (place + place.T), depth_sigma=sqrt(self.covariance[3, 3]))


def _measurements(estimates: list[TouchEstimate]) -> tuple[np.ndarray, np.ndarray]:
    """Places and depths (E, 4) and their covariances (E, 4, 4). Raises BadArgument for numbers that are not finite."""
    values, spreads = np.zeros((len(estimates), 4)), np.zeros((len(estimates), 4, 4))
    for estimate, value, spread in zip(estimates, values, spreads):
        value[:3], value[3] = estimate.position, estimate.depth
        spread[:3, :3], spread[3, 3] = estimate.covariance, estimate.depth_sigma**2
    if not (np.isfinite(values).all() and np.isfinite(spreads).all()):
        raise BadArgument(f'a touch must have a finite place, depth and covariance, got {values}, covariance {spreads}')
    return values, spreads + _LEAST**2 * np.eye(4)
