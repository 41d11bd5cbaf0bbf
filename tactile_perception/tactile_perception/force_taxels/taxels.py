# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Positions, axes and neighbours of taxels on flat and curved patches."""
from __future__ import annotations

import numpy as np

from tactile_driver.force_taxels import tangents

from .._core.force_taxels import Skin
from ..common.surface_points import scattered_normals
from ..core.errors import BadFrame
from .constants import FORCE_TAXEL


class Taxels:
    """Geometry of a sensor.

    Parameters
    ----------
    positions : ndarray, shape (N, 3)
        In m, sensor frame.
    normals : ndarray, shape (N, 3), or None
        Unit normals out of the sensor; None to estimate them from the positions.

    Attributes
    ----------
    axes : ndarray, shape (N, 3, 3)
        Rows: two tangents and the inward normal, so that the third component of a force in these axes is the pressing force.
    skin : Skin
        Contacts and the wrench, in C++.
    pitch : float
        Median distance to the nearest taxel, in m.
    tilt : ndarray, shape (N,)
        Standard deviation of the surface's normal within the cell of a taxel, in rad.
    neighbours : ndarray of int, shape (N, K)
        Of each taxel, filled up with itself.

    Raises
    ------
    BadFrame
        If two taxels are at the same position.
    """

    def __init__(self, positions: np.ndarray, normals: np.ndarray | None = None):
        self.given = positions, normals
        if normals is None:
            normals = scattered_normals(positions)
            normals = np.where(np.isfinite(normals), normals, [0.0, 0.0, 1.0])
        self.positions, self.normals = positions, normals / np.linalg.norm(normals, axis=1, keepdims=True)
        self.axes = np.stack([*tangents(self.normals), -self.normals], axis=1)
        away = np.linalg.norm(positions[:, None] - positions[None], axis=2)
        np.fill_diagonal(away, np.inf)
        if len(positions) > 1 and not away.min() > 0:
            raise BadFrame('taxels: two taxels have the same position')
        self.pitch = float(np.median(away.min(axis=1))) if len(positions) > 1 else FORCE_TAXEL.alone
        near = (away < FORCE_TAXEL.near * self.pitch) & (self.normals @ self.normals.T > FORCE_TAXEL.same_side)
        order = np.argsort(~near, axis=1, kind='stable')[:, :max(int(near.sum(axis=1).max()), 1)]
        self.neighbours = np.where(np.take_along_axis(near, order, axis=1), order, np.arange(len(positions))[:, None])
        turned = np.einsum('nkj,nj->nk', self.normals[self.neighbours], self.normals)
        others = np.maximum((self.neighbours != np.arange(len(positions))[:, None]).sum(axis=1), 1)
        self.tilt = np.sqrt((np.arccos(np.clip(turned, -1, 1))**2).sum(axis=1) / others / 12)
        self.skin = Skin(self.positions, self.normals, self.axes, self.neighbours, self.pitch)

    def fits(self, positions: np.ndarray, normals: np.ndarray | None) -> bool:
        """Whether this is the geometry of such positions and normals."""
        return np.array_equal(positions, self.given[0]) and (
            normals is self.given[1] or normals is not None and self.given[1] is not None and np.array_equal(normals, self.given[1]))

    def local(self, vectors: np.ndarray) -> np.ndarray:
        """Components (N, 3) along two tangents and the inward normal of vectors (N, 3) in the sensor frame."""
        return np.matmul(self.axes, vectors[:, :, None])[:, :, 0]

    def world(self, components: np.ndarray) -> np.ndarray:
        """Vectors (N, 3) in the sensor frame of such components."""
        return np.matmul(components[:, None, :], self.axes)[:, 0]

    def filled(self, components: np.ndarray, alive: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Components (N, 3) in which dead taxels have the mean of their neighbours that are alive, and the indices of the dead ones."""
        dead = np.flatnonzero(~alive)
        if len(dead):
            components = components.copy()
        for k in dead:
            around = [j for j in self.neighbours[k] if alive[j]]
            components[k] = components[around].mean(axis=0) if around else 0.0
        return components, dead
