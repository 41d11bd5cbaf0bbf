# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tracking of touches: persistent ids and a Kalman filter for each touch."""
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ... import _core
from ...errors import BadArgument, BadFrame
from .touch import TouchEstimate

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
        for track in self._tracks:
            track.predict(elapsed)
        pairs = self._pairs(estimates)
        touches, kept = [], []
        for index, estimate in enumerate(estimates):
            track = pairs.get(index) or self._new(estimate)
            if index in pairs:
                track.update(estimate)
            kept.append(track)
            touches.append(Touch(track.id, track.filtered(estimate) if self._filtered else estimate))
        for track in self._tracks:
            if track not in kept and track.missed < _MISSED:
                track.missed += 1
                kept.append(track)
        self._tracks = kept
        return touches

    def _new(self, estimate: TouchEstimate) -> _Track:
        self._next += 1
        return _Track(self._next - 1, estimate)

    def _pairs(self, estimates: list[TouchEstimate]) -> dict[int, _Track]:
        """Index of an estimate -> the track that it continues."""
        if not estimates or not self._tracks:
            return {}
        cost = np.array([[track.distance(estimate) for track in self._tracks] for estimate in estimates])
        bounded = np.minimum(cost, 1e3 * _GATE)
        pairs = enumerate(_core.assign_least(bounded)) if len(estimates) <= len(self._tracks) else \
            ((estimate, track) for track, estimate in enumerate(_core.assign_least(bounded.T)))
        return {int(estimate): self._tracks[track] for estimate, track in pairs if cost[estimate, track] <= _GATE}


class _Track:
    """One touch: place and depth (4,) m, their velocities, and the covariance (8, 8) of both."""

    def __init__(self, id: int, estimate: TouchEstimate):
        self.id, self.missed = id, 0
        value, covariance = _measurement(estimate)
        self._state = np.r_[value, np.zeros(4)]
        self._cov = np.zeros((8, 8))
        self._cov[:4, :4] = covariance
        self._cov[4:, 4:] = _SPEED**2 * np.eye(4)

    def predict(self, elapsed: float) -> None:
        """Propagate at constant velocity over elapsed s."""
        move = np.eye(8)
        move[:4, 4:] = elapsed * np.eye(4)
        gain = np.vstack([0.5 * elapsed**2 * np.eye(4), elapsed * np.eye(4)])
        self._state = move @ self._state
        self._cov = move @ self._cov @ move.T + ACCELERATION**2 * gain @ gain.T

    def distance(self, estimate: TouchEstimate) -> float:
        """Squared Mahalanobis distance of an estimate from the predicted touch."""
        value, covariance = _measurement(estimate)
        off = value - self._state[:4]
        return float(off @ np.linalg.solve(self._cov[:4, :4] + covariance, off))

    def update(self, estimate: TouchEstimate) -> None:
        """Kalman update in Joseph's form, which keeps the covariance symmetric and positive definite despite rounding."""
        value, covariance = _measurement(estimate)
        gain = np.linalg.solve(self._cov[:4, :4] + covariance, self._cov[:4]).T
        rest = np.eye(8)
        rest[:, :4] -= gain
        self._state = self._state + gain @ (value - self._state[:4])
        self._cov = rest @ self._cov @ rest.T + gain @ covariance @ gain.T
        self.missed = 0

    def filtered(self, estimate: TouchEstimate) -> TouchEstimate:
        """The estimate with filtered place, depth and covariance."""
        place = self._cov[:3, :3]
        return replace(estimate, position=self._state[:3].copy(), depth=float(max(self._state[3], 0.0)),
                       covariance=0.5 * (place + place.T), depth_sigma=float(np.sqrt(self._cov[3, 3])))


def _measurement(estimate: TouchEstimate) -> tuple[np.ndarray, np.ndarray]:
    """Place and depth (4,) and their covariance (4, 4). Raises BadArgument for numbers that are not finite."""
    value = np.r_[estimate.position, estimate.depth]
    covariance = np.zeros((4, 4))
    covariance[:3, :3], covariance[3, 3] = estimate.covariance, estimate.depth_sigma**2
    if not (np.isfinite(value).all() and np.isfinite(covariance).all()):
        raise BadArgument(f'a touch must have a finite place, depth and covariance, got {value}, sigma {np.sqrt(np.diag(covariance))}')
    return value, covariance + _LEAST**2 * np.eye(4)
