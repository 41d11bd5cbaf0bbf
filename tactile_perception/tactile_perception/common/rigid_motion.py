# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Rigid registration of two point sets, with named degenerate cases and covariance."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._core import rigid_inliers, rigid_motion
from .rotations import rotation_vector
from ..errors import BadArgument, DegenerateFit

# Least variance across the long axis relative to that along it; below, the rotation about the long axis is unobservable.
_NARROW = 1e-6
# Third singular value, relative to the second, of a reflection; noise reaches it at 10 % of the point spread.
_MIRRORED = 1e-2
_LARGEST = 1e60  # m, m^-2: the product of a weight and four such numbers does not overflow


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
    p, q, w = _checked(p, q, weights)
    rotation, translation = _solve(p, q, w)
    return RigidFit(rotation, translation, q, q - p @ rotation.T - translation, w, weights is not None)


def fit_rigid_robust(p: np.ndarray, q: np.ndarray, sigma: np.ndarray | float, steps: int = 10) -> RigidFit:
    """Robust motion of the majority of the points: Tukey's biweight from the best of some fixed starts.

    p, q: (N, 3) m; sigma: (N,) or a number, standard deviation of a coordinate of q - p, m. The starts are chosen by a fixed rule, so that
    the same points give the same answer. Weights of points that do not share the motion are 0. Kernel: src/common/rigid_motion.cpp.
    Raises BadArgument, DegenerateFit as fit_rigid.
    """
    sigma = np.broadcast_to(np.asarray(sigma, float), (len(p),))
    if not (np.isfinite(sigma).all() and (sigma > 0).all()):
        raise BadArgument('fit_rigid_robust: sigma must be positive and finite, m')
    p, q, base = _checked(p, q, 1 / (sigma * sigma))
    _check_count(base)
    weights = rigid_inliers(p, q, base, steps=steps)
    rotation, translation = _solve(p, q, weights)
    return RigidFit(rotation, translation, q, q - p @ rotation.T - translation, weights, True)


def _checked(p, q, weights) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    p, q = np.asarray(p, float), np.asarray(q, float)
    w = np.ones(len(p)) if weights is None else np.asarray(weights, float)
    if p.ndim != 2 or p.shape[1] != 3 or q.shape != p.shape or w.shape != (len(p),):
        raise BadArgument(f'rigid fit: need p and q (N, 3) and weights (N,), got {p.shape}, {q.shape}, {w.shape}')
    sizes = [np.abs(values).max(initial=0.0) for values in (p, q, w)]
    if not (max(sizes) <= _LARGEST and w.min(initial=0.0) >= 0) or np.isnan(sizes).any():
        raise BadArgument(f'rigid fit: points and weights must be finite (to {_LARGEST:g}), weights not negative; leave unseen dots out')
    return p, q, w


def _check_count(w: np.ndarray) -> None:
    if np.count_nonzero(w) < 3:
        raise DegenerateFit('too_few', f'a rigid motion needs 3 points of positive weight, got {np.count_nonzero(w)}')


def _solve(p: np.ndarray, q: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    _check_count(w)
    rotation, translation, *singular = rigid_motion(p, q, w)
    share = w / w.sum()
    _check_rank(p - share @ p, q - share @ q, share, *singular)
    return rotation, translation


def _check_rank(p_off: np.ndarray, q_off: np.ndarray, share: np.ndarray, second: float, third: float) -> None:
    """second, third: singular values, the third negative for mirror images."""
    spreads = np.linalg.eigvalsh([(share[:, None] * off).T @ off for off in (p_off, q_off)])
    for name, spread in zip('pq', spreads):
        if spread[2] <= 1e-24:  # a picometre: the points coincide in any sensor
            raise DegenerateFit('coincident', f'all points of {name} are at one place')
        if spread[1] <= _NARROW * spread[2]:
            raise DegenerateFit('collinear', f'the points of {name} lie on a line; the turn about it is open')
    if -third > _MIRRORED * second:
        raise DegenerateFit('reflection', 'q is a mirror image of p, no rigid motion makes it')


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
