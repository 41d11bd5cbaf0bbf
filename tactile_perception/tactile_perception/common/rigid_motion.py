# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Rigid registration of two point sets, with named degenerate cases and covariance."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._core import rigid_motion
from .geometry import rotation_vector
from ..errors import BadArgument, DegenerateFit

# Why points leave a motion open, in the kernel's order.
_OPEN = (None, ('too_few', 'a rigid motion needs 3 points of positive weight'), ('coincident', 'all points of p are at one place'),
         ('coincident', 'all points of q are at one place'), ('collinear', 'the points of p lie on a line; the turn about it is open'),
         ('collinear', 'the points of q lie on a line; the turn about it is open'),
         ('reflection', 'q is a mirror image of p, no rigid motion makes it'))


@dataclass(frozen=True)
class RigidFit:
    """q = rotation @ p + translation.

    rotation: (3, 3); translation: (3,) m; points: (N, 3) m, q; residuals: (N, 3) m, q less its prediction; weights: (N,) as used in the
    last step; known: whether these are 1 / variance, m^-2.
    """

    rotation: np.ndarray
    translation: np.ndarray
    points: np.ndarray
    residuals: np.ndarray
    weights: np.ndarray
    known: bool

    def apply(self, points: np.ndarray) -> np.ndarray:
        """Points (N, 3) transformed by the motion."""
        return points @ self.rotation.T + self.translation

    @property
    def covariance(self) -> np.ndarray:
        """(6, 6) of (small rotation vector, rad, applied after rotation about the sensor's origin; translation, m)."""
        return _covariance(self.points - self.residuals, self.residuals, self.weights, self.known)

    @property
    def rotation_vector(self) -> np.ndarray:
        """(3,) axis times angle, rad."""
        return rotation_vector(self.rotation)


def fit_rigid(p: np.ndarray, q: np.ndarray, weights: np.ndarray | None = None) -> RigidFit:
    """Least squares over p (N, 3) and q (N, 3), m, by quaternions (Horn 1987). Kernel: src/common/rigid_motion.cpp.

    weights (N,): 1 / variance of a coordinate, m^-2; without them all are equal and the covariance is scaled by the residuals.
    Raises BadArgument for wrong shapes, NaN or negative weights; DegenerateFit where the points leave the motion open.
    """
    return _fit(p, q, np.ones(len(p)) if weights is None else weights, weights is not None)


def fit_rigid_robust(p: np.ndarray, q: np.ndarray, sigma: np.ndarray | float, steps: int = 10) -> RigidFit:
    """Robust motion of the majority of the points: Tukey's biweight from the best of some fixed starts.

    p, q: (N, 3) m; sigma: (N,) or a number, standard deviation of a coordinate of q - p, m. The starts are chosen by a fixed rule, so that
    the same points give the same answer. Weights of points that do not share the motion are 0. Kernel: src/common/rigid_motion.cpp.
    Raises BadArgument, DegenerateFit as fit_rigid.
    """
    sigma = np.broadcast_to(np.asarray(sigma, float), (len(p),))
    if not (np.isfinite(sigma).all() and (sigma > 0).all()):
        raise BadArgument('fit_rigid_robust: sigma must be positive and finite, m')
    return _fit(p, q, 1 / (sigma * sigma), True, steps)


def _fit(p: np.ndarray, q: np.ndarray, weights: np.ndarray, known: bool, steps: int = 0) -> RigidFit:
    p, q = np.asarray(p, float), np.asarray(q, float)
    try:
        rotation, translation, residuals, used, opened = rigid_motion(p, q, np.asarray(weights, float), steps=steps)
    except ValueError as error:
        raise BadArgument(f'rigid fit: p, q (N, 3), weights (N,) >= 0 must be finite; leave unseen dots out: {error}') from error
    if opened:
        raise DegenerateFit(*_OPEN[opened])
    return RigidFit(rotation, translation, q, residuals, used, known)


def _covariance(carried: np.ndarray, residuals: np.ndarray, w: np.ndarray, known: bool) -> np.ndarray:
    """(6, 6) by the normal equations; carried: (N, 3) predicted places; scaled by the residuals unless weights are known variances."""
    centre = w @ carried / w.sum()
    arm = carried - centre
    inertia = np.eye(3) * (w @ np.sum(arm**2, axis=1)) - (w[:, None] * arm).T @ arm
    turn = np.linalg.inv(inertia)
    cross = np.array([[0, -centre[2], centre[1]], [centre[2], 0, -centre[0]], [-centre[1], centre[0], 0]])
    covariance = np.empty((6, 6))
    covariance[:3, :3] = turn
    covariance[:3, 3:] = turn @ cross.T
    covariance[3:, :3] = covariance[:3, 3:].T
    covariance[3:, 3:] = cross @ turn @ cross.T + np.eye(3) / w.sum()
    if known:
        return covariance
    freedom = 3 * len(w) - 6
    return covariance * (np.sum(w[:, None] * residuals**2) / freedom if freedom > 0 else np.nan)
