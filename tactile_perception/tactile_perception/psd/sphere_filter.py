# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A Kalman filter for a point on the unit sphere with nearly constant velocity.

The state is a unit vector and its velocity in the tangent plane. Their covariance refers to a tangent basis that is parallel transported,
so neither the pole nor azimuth pi is singular. Constant velocity is followed without lag, a change of velocity within about sqrt(2 s / a):
s is the standard deviation of a measurement, rad, a the acceleration, rad/s^2.
"""
from __future__ import annotations

import numpy as np

from ..common.vectors import tangents
from ..errors import BadArgument

_UNIT = 1e-3  # tolerance of a unit vector's squared length. Chosen: beyond float32 rounding
_FIRST_SPEED = 10.0  # rad/s, standard deviation of a new contact's speed. Chosen: 16 cm/s on a 16 mm finger, as a hand slides


class SphereFilter:
    """acceleration: rad/s^2, standard deviation of the process noise. Raises BadArgument where it is not positive and finite."""

    def __init__(self, acceleration: float):
        if not 0 < acceleration < np.inf:
            raise BadArgument(f'filter.acceleration is {acceleration} rad/s^2; it must be positive')
        self._acceleration = acceleration
        self.begin()

    def begin(self) -> None:
        """Forget; the next measurement is the first."""
        self._normal: np.ndarray | None = None

    def update(self, normal: np.ndarray, covariance: np.ndarray, seconds: float) -> tuple[np.ndarray, np.ndarray]:
        """(unit vector (3,), covariance (3, 3), rad^2) after a measurement normal (3,) with covariance (3, 3), rad^2, seconds after the
        last one. Raises BadArgument for a vector that is not of unit length or a covariance that is not finite."""
        if not (abs(normal @ normal - 1) < _UNIT and np.isfinite(covariance).all()):
            raise BadArgument(f'sphere filter: need a unit vector and a finite covariance, got {normal}, {covariance}')
        if self._normal is None:
            self._normal, self._basis, self._speed = normal, tangents(normal), np.zeros(2)
            self._spread = np.zeros((4, 4))
            self._spread[:2, :2], self._spread[2:, 2:] = self._basis @ covariance @ self._basis.T, _FIRST_SPEED**2 * np.eye(2)
            return normal, covariance
        self._predict(max(seconds, 0.0))
        noise = self._basis @ covariance @ self._basis.T + 1e-12 * np.eye(2)
        gain = np.linalg.solve(self._spread[:2, :2] + noise, self._spread[:2]).T
        change = gain @ self._innovation(normal)
        self._speed = self._speed + change[2:]
        rest = np.eye(4)
        rest[:, :2] -= gain
        self._spread = rest @ self._spread @ rest.T + gain @ noise @ gain.T  # Joseph form: stays positive definite
        self._move(change[:2])
        return self._normal, self._basis.T @ self._spread[:2, :2] @ self._basis

    def _predict(self, seconds: float) -> None:
        step = np.eye(4)
        step[:2, 2:] = seconds * np.eye(2)
        push = np.concatenate([0.5 * seconds**2 * np.eye(2), seconds * np.eye(2)])
        self._spread = step @ self._spread @ step.T + self._acceleration**2 * push @ push.T
        self._move(seconds * self._speed)

    def _innovation(self, normal: np.ndarray) -> np.ndarray:
        """Logarithmic map of a unit vector at the present one, (2,) rad in the basis."""
        across = self._basis @ normal
        length = np.linalg.norm(across)
        return across * (np.arctan2(length, self._normal @ normal) / length) if length > 0 else across

    def _move(self, by: np.ndarray) -> None:
        """Move by (2,) rad along a great circle, with parallel transport of the basis."""
        angle = np.linalg.norm(by)
        if angle < 1e-15:
            return
        ahead = (by / angle) @ self._basis
        old = self._normal
        self._normal = np.cos(angle) * old + np.sin(angle) * ahead
        turned = np.cos(angle) * ahead - np.sin(angle) * old
        self._basis = self._basis + (self._basis @ ahead)[:, None] * (turned - ahead)
        self._normal /= np.linalg.norm(self._normal)
