# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Rigid motion of an object between two frames from the dots that it carries along, followed from frame to frame.

A camera measures a dot's motion across its ray to a micrometre and along it fifty times worse, so that the two count by their own errors. A motion is a
twist (6,): velocity of the point at the centre (m a frame) and w = 2 tan(angle / 2) times the axis; Cayley's form makes it exact and linear:
after - before = v + w x ((before + after) / 2 - centre).
"""
from __future__ import annotations

import numpy as np

# Scale of a turn against a shift, m: both count alike at this distance.
_LEVER = 5e-3
# Cosine from which a dot that is ahead counts as leading, and how much less its distance then speaks against it.
_LEADS, _PATIENCE = 0.3, 0.04


class DotMotions:
    """Motions of N dots between two frames: before, after (N, 3) m, seen from origin (3,).

    across: standard deviation across the ray, m; along: standard deviation along the ray, m.
    """

    def __init__(self, before: np.ndarray, after: np.ndarray, origin: np.ndarray, across: float, along: float):
        self.centre = after.mean(0)
        middle = (before + after) / 2 - self.centre
        rays = (before + after) / 2 - origin
        self.rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        self.moved = after - before
        self.across, self.along = across, along
        self.rows = _rows(middle)

    def off(self, twist: np.ndarray) -> np.ndarray:
        """What each dot moved beyond the twist (6,), across its ray, (N, 3) m."""
        left = self.moved - self.rows @ twist
        return left - (left * self.rays).sum(1, keepdims=True) * self.rays

    def off_along(self, twist: np.ndarray) -> np.ndarray:
        """The same along the rays, (N,) m."""
        return ((self.moved - self.rows @ twist) * self.rays).sum(1)

    def fit(self, weights: np.ndarray, expected: np.ndarray | None = None, hold: float = 0.0) -> np.ndarray:
        """Twist (6,) by least squares with weights (N,); expected (6,) counts as hold dots that moved like that."""
        across = self.rows - self.rays[:, :, None] * np.einsum('nc,nct->nt', self.rays, self.rows)[:, None, :]
        along = np.einsum('nc,nct->nt', self.rays, self.rows)
        scale = (self.across / self.along)**2
        matrix = np.einsum('n,nct,ncs->ts', weights, across, self.rows) + scale * (along * weights[:, None]).T @ along
        right = np.einsum('n,nct,nc->t', weights, across, self.moved) + scale * along.T @ (weights * (self.moved * self.rays).sum(1))
        prior = np.diag([1, 1, 1, _LEVER**2, _LEVER**2, _LEVER**2])
        matrix = matrix + (hold + 1e-6) * prior
        if expected is not None:
            right = right + hold * prior @ expected
        return np.linalg.solve(matrix, right)

    def follow(self, start: np.ndarray | None, drag: np.ndarray, coarse: float, fine: float, hold: float, weights: np.ndarray) -> np.ndarray:
        """The twist of what carries the dots, near start (None: near their mean motion), the bound on what agrees narrowed from coarse to fine, m.

        drag (N, 3): load across the surface on each dot. One that lags behind in that direction may slip and soon counts nothing; one that
        leads cannot, and keeps counting. weights (N,): how likely each dot sticks; start counts as hold dots.
        """
        twist = self.fit(weights) if start is None else start
        for bound in np.geomspace(coarse, fine, 6):
            left = self.off(twist)
            size = np.linalg.norm(left, axis=1)
            leads = (left * drag).sum(1) > _LEADS * size * np.linalg.norm(drag, axis=1)
            depth = self.off_along(twist) / np.hypot(bound, 2 * self.along)
            twist = self.fit(weights / (1 + np.where(leads, _PATIENCE, 1) * (size / bound)**2 + depth**2)**2, start, hold)
        return twist


def _rows(offset: np.ndarray) -> np.ndarray:
    """(N, 3, 6): motion of points at offset (N, 3) from the centre, by a twist."""
    rows = np.zeros((len(offset), 3, 6))
    rows[:, [0, 1, 2], [0, 1, 2]] = 1
    x, y, z = offset.T
    rows[:, 0, 4], rows[:, 0, 5] = z, -y
    rows[:, 1, 3], rows[:, 1, 5] = -z, x
    rows[:, 2, 3], rows[:, 2, 4] = y, -x
    return rows


def moved_to(twist: np.ndarray, centre: np.ndarray, to: np.ndarray) -> np.ndarray:
    """The same motion as a twist (6,) about the point to (3,) instead of centre (3,)."""
    return np.concatenate([twist[:3] + np.cross(twist[3:], to - centre), twist[3:]])
