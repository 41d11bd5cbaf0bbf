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

from ... import _core
from ...common.vectors import cross

_LOOSE = 1e-3  # weight of a twist, in dots, that is kept where nothing else tells; chosen


class DotMotions:
    """Motions of N dots in contact between two frames: before, after (N, 3) m, normals (N, 3), seen from origin (3,), m.

    across, along: standard deviation of a motion across the ray and along the normal, m. centre (3,) m: of the twists; moved_across
    (N, 3) m: the motions across the rays.
    """

    def __init__(self, before: np.ndarray, after: np.ndarray, normals: np.ndarray, origin: np.ndarray, across: float, along: float):
        self.centre = after.mean(axis=0)
        self._of = before, after, normals, origin
        self._sigma = {'across': across, 'along': along}
        self.moved_across = self.residuals(np.zeros(6))

    def residuals(self, twist: np.ndarray) -> np.ndarray:
        """(N, 3) m: each dot's motion across its ray less that of the twist (6,)."""
        return _core.motion_residuals(*self._of, twist)[0]

    def normal_residuals(self, twist: np.ndarray) -> np.ndarray:
        """(N,) m: the same along the normals."""
        return _core.motion_residuals(*self._of, twist)[1]

    def constrained_to_normals(self, twist: np.ndarray) -> np.ndarray:
        """twist (6,) with the components that move the surface along its normals fitted to the dots, the others, which slip hides, kept."""
        return self.fit_robust(twist, np.zeros_like(self.moved_across), 1.0, 1.0, _LOOSE, np.zeros(len(self.moved_across)))

    def fit_robust(self, start: np.ndarray | None, drag: np.ndarray, coarse: float, fine: float, hold: float,
                   weights: np.ndarray) -> np.ndarray:
        """Twist (6,) of the object by iteratively reweighted least squares, the scale of the residuals reduced from coarse to fine, m.

        start: initial twist and prior that weighs hold dots, None: fit to all dots. drag: (N, 3) tangential load on each dot; a dot that
        lags in its direction may slip and loses its weight, one that leads cannot slip and keeps it. weights: (N,) probability of sticking.
        """
        return _core.fit_motion(*self._of, np.zeros(6) if start is None else start, drag, weights, **self._sigma, coarse=coarse, fine=fine,
                                hold=hold, fresh=start is None)


def across_rays(before: np.ndarray, after: np.ndarray, origin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Motions (N, 3) m from before to after (N, 3) m across the rays from origin (3,), and these unit rays (N, 3)."""
    rays = (before + after) / 2 - origin
    rays /= lengths(rays)[:, None]
    moved = after - before
    return moved - np.einsum('ij,ij->i', moved, rays)[:, None] * rays, rays


def lengths(vectors: np.ndarray) -> np.ndarray:
    """Lengths (N,) of vectors (N, C)."""
    return np.sqrt(np.einsum('ij,ij->i', vectors, vectors))


def twist_about(twist: np.ndarray, centre: np.ndarray, to: np.ndarray) -> np.ndarray:
    """The twist (6,) about the point to (3,) instead of centre (3,)."""
    return np.concatenate([twist[:3] + cross(twist[3:], to - centre), twist[3:]])
