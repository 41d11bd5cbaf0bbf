# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Rigid motion of points, with named degenerate cases."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import rotation_vector
from .statistics import all_within
from ..errors import BadArgument, DegenerateFit

_LARGEST = 1e100  # m: squares of larger numbers may overflow
_ONE_PLACE = 1e-12  # m: points nearer than a picometre coincide in any sensor
_NARROW = 1e-3  # least width over length of the points; below, the turn about their line is open. Chosen
_MIRRORED = 1e-2  # third singular value over the second of a reflection; noise reaches it at 10 % of the spread


@dataclass(frozen=True)
class RigidMotion:
    """q = rotation @ p + translation. rotation: (3, 3); translation: (3,) m."""

    rotation: np.ndarray
    translation: np.ndarray

    def apply(self, points: np.ndarray) -> np.ndarray:
        """Points (N, 3) transformed by the motion."""
        return points @ self.rotation.T + self.translation

    @property
    def rotation_vector(self) -> np.ndarray:
        """(3,) axis times angle, rad."""
        return rotation_vector(self.rotation)


def fit_rigid(p: np.ndarray, q: np.ndarray) -> RigidMotion:
    """Least squares over p (N, 3) and q (N, 3), m (Kabsch 1976). Raises BadArgument for wrong shapes and NaN; DegenerateFit where the
    points leave the motion open."""
    p, q = np.asarray(p, float), np.asarray(q, float)
    if p.shape != q.shape or p.ndim != 2 or p.shape[1] != 3 or not (all_within(p, most=_LARGEST) and all_within(q, most=_LARGEST)):
        raise BadArgument(f'rigid fit: p, q (N, 3) must be finite, got {p.shape} and {q.shape}; leave unseen dots out')
    if len(p) < 3:
        raise DegenerateFit('too_few', 'a rigid motion needs 3 points')
    before, after = p - p.mean(axis=0), q - q.mean(axis=0)
    for name, points in (('p', before), ('q', after)):
        length, width, _ = np.linalg.svd(points, compute_uv=False) / np.sqrt(len(p))
        if not length > _ONE_PLACE:
            raise DegenerateFit('coincident', f'all points of {name} are at one place')
        if width <= _NARROW * length:
            raise DegenerateFit('collinear', f'the points of {name} lie on a line; the turn about it is open')
    u, size, v = np.linalg.svd(before.T @ after)
    hand = np.sign(np.linalg.det(u @ v))
    if hand < 0 and size[2] > _MIRRORED * size[1]:
        raise DegenerateFit('reflection', 'q is a mirror image of p, no rigid motion makes it')
    rotation = (u * [1, 1, hand] @ v).T
    return RigidMotion(rotation, q.mean(axis=0) - rotation @ p.mean(axis=0))
