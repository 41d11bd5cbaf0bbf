# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Rigid motion of an object between two frames from the dots that it carries along, followed from frame to frame.

A camera measures a dot's motion across its ray to a micrometre and along it fifty times worse. So a dot that is carried agrees across its
ray with the object's motion; and each dot that touches, carried or not, follows the object along the normal, as well as that is known. A
motion is a twist (6,): velocity of the point at the centre (m a frame) and w = 2 tan(angle / 2) times the axis; Cayley's form makes it
exact and linear: after - before = v + w x ((before + after) / 2 - centre).
"""
from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from ...common.vectors import cross

# Scale of a turn against a shift, m: both count alike at this distance.
_LEVER = 5e-3
# Cosine from which a dot that is ahead counts as leading, and how much less its distance then speaks against it.
_LEADS, _PATIENCE = 0.3, 0.04
_RIDGE, _LOOSE = 1e-4, 1e-3
_PRIOR = np.diag([1, 1, 1, _LEVER**2, _LEVER**2, _LEVER**2])
_NARROWINGS = 4


class DotMotions:
    """Motions of N dots that touch an object between two frames: before, after (N, 3) m, normals (N, 3), seen from origin (3,).

    across, along: standard deviation of a motion across the ray and along the normal, m. centre (3,) m: of the twists; moved_across
    (N, 3) m: the motions across the rays.
    """

    def __init__(self, before: np.ndarray, after: np.ndarray, normals: np.ndarray, origin: np.ndarray, across: float, along: float):
        self.centre = after.mean(0)
        self.along = along
        self.moved_across, rays = across_rays(before, after, origin)
        moved = after - before
        self.rows = _rows((before + after) / 2 - self.centre)
        # Rows of each dot's equations, the right side last: across the ray and along the normal.
        parts = np.empty((len(before), 3, 7))
        np.subtract(self.rows, rays[:, :, None] * np.matmul(rays[:, None], self.rows), out=parts[:, :, :6])
        parts[:, :, 6] = self.moved_across
        self._rows_across = parts[:, :, :6].reshape(-1, 6)
        touching = np.empty((len(before), 7))
        touching[:, :6] = np.matmul(normals[:, None], self.rows)[:, 0]
        touching[:, 6] = np.einsum('ij,ij->i', moved, normals)
        self._rows_normal, self._moved_normal = np.ascontiguousarray(touching[:, :6]), touching[:, 6].copy()
        # Each dot's part of the normal equations, so that a fit is a product with the weights.
        self._carried_parts = np.matmul(parts.transpose(0, 2, 1), parts).reshape(-1, 49)
        self._touching_parts = (((across / along)**2 * touching)[:, :, None] * touching[:, None]).reshape(-1, 49)

    def residuals(self, twist: np.ndarray) -> np.ndarray:
        """What each dot moved beyond the twist (6,), across its ray, (N, 3) m."""
        return self.moved_across - (self._rows_across @ twist).reshape(-1, 3)

    def normal_residuals(self, twist: np.ndarray) -> np.ndarray:
        """The same along the normals, (N,) m."""
        return self._moved_normal - self._rows_normal @ twist

    def fit(self, carried: np.ndarray, touching: np.ndarray, expected: np.ndarray | None = None, hold: float = 0.0) -> np.ndarray:
        """Twist (6,) by least squares: across the rays with weights carried (N,), along the normals with weights touching (N,).

        expected (6,) counts as hold dots that were carried like that.
        """
        system = (carried @ self._carried_parts + touching @ self._touching_parts).reshape(7, 7)
        matrix, right = system[:6, :6] + _RIDGE * _PRIOR, system[:6, 6]
        if expected is not None:
            matrix, right = matrix + hold * _PRIOR, right + hold * _PRIOR @ expected
        return lapack.dposv(matrix, right)[1]

    def constrained_to_normals(self, twist: np.ndarray) -> np.ndarray:
        """twist (6,) with what moves the face along its normals (shift and tilt) taken from the dots, and the rest, that slip may hide,
        left alone."""
        touching = 1 / (1 + (self.normal_residuals(twist) / (10 * self.along))**2)
        return self.fit(np.zeros(len(touching)), touching, twist, _LOOSE)

    def fit_robust(self, start: np.ndarray | None, drag: np.ndarray, coarse: float, fine: float, hold: float,
               weights: np.ndarray) -> np.ndarray:
        """The twist of what carries the dots, near start (None: near their mean motion), the bound on what agrees narrowed from coarse to
        fine, m.

        drag (N, 3): load across the surface on each dot. One that lags behind in that direction may slip and soon counts nothing; one that
        leads cannot, and keeps counting. weights (N,): how likely each dot sticks; start counts as hold dots.
        """
        twist = self.fit(weights, np.ones(len(weights))) if start is None else start
        leading = _LEADS * lengths(drag)
        for narrowing in range(_NARROWINGS):
            bound = coarse * (fine / coarse)**(narrowing / (_NARROWINGS - 1))
            left = self.residuals(twist)
            square = np.einsum('ij,ij->i', left, left)
            leads = np.einsum('ij,ij->i', left, drag) > leading * np.sqrt(square)
            square *= np.where(leads, _PATIENCE / bound**2, 1 / bound**2)
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
    """(N, 3, 6): motion of points at offset (N, 3) from the centre, by a twist."""
    rows = np.zeros((len(offset), 3, 6))
    rows[:, :, :3] = np.eye(3)
    x, y, z = offset.T
    rows[:, 0, 4], rows[:, 0, 5] = z, -y
    rows[:, 1, 3], rows[:, 1, 5] = -z, x
    rows[:, 2, 3], rows[:, 2, 4] = y, -x
    return rows


def twist_about(twist: np.ndarray, centre: np.ndarray, to: np.ndarray) -> np.ndarray:
    """The same motion as a twist (6,) about the point to (3,) instead of centre (3,)."""
    return np.concatenate([twist[:3] + cross(twist[3:], to - centre), twist[3:]])
