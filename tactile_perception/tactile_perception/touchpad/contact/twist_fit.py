# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Robust fit of an object's rigid motion between two frames to the motions of the dots in contact.

A camera measures a dot's motion across its ray to a micrometre and along it fifty times worse. Sticking dots follow the object across
their rays; all dots in contact, sticking or slipping, follow it along the surface normal. A motion is a twist (6,): translation of the
centre (m a frame) and w = 2 tan(angle / 2) times the axis. Cayley's form is exact and linear:
after - before = v + w x ((before + after) / 2 - centre).
"""
from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from ...common.vectors import cross

_LEVER = 5e-3  # m, distance at which rotation and translation weigh the same in the prior; chosen
# A dot whose residual points along its drag (cosine above the first) leads the object; its squared residual counts by the second; chosen.
_LEADS, _LEADING_WEIGHT = 0.3, 0.04
_RIDGE, _LOOSE = 1e-4, 1e-3  # weights of the prior, in dots, that keep a fit regular; chosen
_PRIOR = np.diag([1, 1, 1, _LEVER**2, _LEVER**2, _LEVER**2])
_ITERATIONS = 4  # of reweighting; chosen


class DotMotions:
    """Motions of N dots in contact between two frames: before, after (N, 3) m, normals (N, 3), seen from origin (3,), m.

    across, along: standard deviation of a motion across the ray and along the normal, m. centre (3,) m: of the twists; moved_across
    (N, 3) m: the motions across the rays.
    """

    def __init__(self, before: np.ndarray, after: np.ndarray, normals: np.ndarray, origin: np.ndarray, across: float, along: float):
        self.centre = after.mean(0)
        self.along = along
        self.moved_across, rays = across_rays(before, after, origin)
        moved = after - before
        self.rows = _rows((before + after) / 2 - self.centre)
        # Each dot's equations, the right side last: across the ray and along the normal.
        parts = np.empty((len(before), 3, 7))
        np.subtract(self.rows, rays[:, :, None] * np.matmul(rays[:, None], self.rows), out=parts[:, :, :6])
        parts[:, :, 6] = self.moved_across
        self._rows_across = parts[:, :, :6].reshape(-1, 6)
        touching = np.empty((len(before), 7))
        touching[:, :6] = np.matmul(normals[:, None], self.rows)[:, 0]
        touching[:, 6] = np.einsum('ij,ij->i', moved, normals)
        self._rows_normal, self._moved_normal = np.ascontiguousarray(touching[:, :6]), touching[:, 6].copy()
        # Each dot's normal equations: a fit sums them by the weights.
        self._carried_parts = np.matmul(parts.transpose(0, 2, 1), parts).reshape(-1, 49)
        self._touching_parts = (((across / along)**2 * touching)[:, :, None] * touching[:, None]).reshape(-1, 49)

    def residuals(self, twist: np.ndarray) -> np.ndarray:
        """(N, 3) m: each dot's motion across its ray less that of the twist (6,)."""
        return self.moved_across - (self._rows_across @ twist).reshape(-1, 3)

    def normal_residuals(self, twist: np.ndarray) -> np.ndarray:
        """(N,) m: the same along the normals."""
        return self._moved_normal - self._rows_normal @ twist

    def fit(self, carried: np.ndarray, touching: np.ndarray, expected: np.ndarray | None = None, hold: float = 0.0) -> np.ndarray:
        """Twist (6,) by least squares: across the rays with weights carried (N,), along the normals with weights touching (N,).

        expected (6,): prior that weighs as much as hold dots.
        """
        system = (carried @ self._carried_parts + touching @ self._touching_parts).reshape(7, 7)
        matrix, right = system[:6, :6] + _RIDGE * _PRIOR, system[:6, 6]
        if expected is not None:
            matrix, right = matrix + hold * _PRIOR, right + hold * _PRIOR @ expected
        return lapack.dposv(matrix, right)[1]

    def constrained_to_normals(self, twist: np.ndarray) -> np.ndarray:
        """twist (6,) with the components that move the surface along its normals fitted to the dots, the others, which slip hides, kept."""
        touching = 1 / (1 + (self.normal_residuals(twist) / (10 * self.along))**2)
        return self.fit(np.zeros(len(touching)), touching, twist, _LOOSE)

    def fit_robust(self, start: np.ndarray | None, drag: np.ndarray, coarse: float, fine: float, hold: float,
               weights: np.ndarray) -> np.ndarray:
        """Twist (6,) of the object by iteratively reweighted least squares, the scale of the residuals reduced from coarse to fine, m.

        start: initial twist and prior that weighs hold dots, None: fit to all dots. drag: (N, 3) tangential load on each dot; a dot that
        lags in its direction may slip and loses its weight, one that leads cannot slip and keeps it. weights: (N,) probability of sticking.
        """
        twist = self.fit(weights, np.ones(len(weights))) if start is None else start
        leading = _LEADS * lengths(drag)
        for narrowing in range(_ITERATIONS):
            bound = coarse * (fine / coarse)**(narrowing / (_ITERATIONS - 1))
            left = self.residuals(twist)
            square = np.einsum('ij,ij->i', left, left)
            leads = np.einsum('ij,ij->i', left, drag) > leading * np.sqrt(square)
            square *= np.where(leads, _LEADING_WEIGHT / bound**2, 1 / bound**2)
            square += 1
            square *= square
            off = self.normal_residuals(twist) * (1 / (3 * self.along))
            twist = self.fit(weights / square, 1 / (1 + off * off), start, hold)
        return twist


def across_rays(before: np.ndarray, after: np.ndarray, origin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Motions (N, 3) m from before to after (N, 3) m across the rays from origin (3,), and these unit rays (N, 3)."""
    rays = (before + after) / 2 - origin
    rays /= lengths(rays)[:, None]
    moved = after - before
    return moved - np.einsum('ij,ij->i', moved, rays)[:, None] * rays, rays


def lengths(vectors: np.ndarray) -> np.ndarray:
    """Lengths (N,) of vectors (N, C)."""
    return np.sqrt(np.einsum('ij,ij->i', vectors, vectors))


def _rows(offset: np.ndarray) -> np.ndarray:
    """(N, 3, 6): Jacobian of the motion of points at offset (N, 3) from the centre by the twist."""
    rows = np.zeros((len(offset), 3, 6))
    rows[:, :, :3] = np.eye(3)
    x, y, z = offset.T
    rows[:, 0, 4], rows[:, 0, 5] = z, -y
    rows[:, 1, 3], rows[:, 1, 5] = -z, x
    rows[:, 2, 3], rows[:, 2, 4] = y, -x
    return rows


def twist_about(twist: np.ndarray, centre: np.ndarray, to: np.ndarray) -> np.ndarray:
    """The twist (6,) about the point to (3,) instead of centre (3,)."""
    return np.concatenate([twist[:3] + cross(twist[3:], to - centre), twist[3:]])
