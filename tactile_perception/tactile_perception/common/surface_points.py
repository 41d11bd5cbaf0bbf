# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A sensor's surface as points: position, displacement, force and contact state of each dot or taxel."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import BadArgument
from .surface import grid_normals

NON_CONTACT, STICKING, SLIPPING, UNKNOWN = 0, 1, 2, 255
_NEIGHBOURS = 8  # of a dot on a grid
_MIN_POINTS = 4  # for a plane with one degree of freedom left


@dataclass(frozen=True)
class SurfacePoints:
    """K points in the order of their ids, in the sensor frame; unknown is NaN.

    shape: rows and columns of the grid, row by row, (1, K) without one; xyz: (K, 3) m; normal: (K, 3) unit, out of the sensor;
    displacement: (K, 3) m, from the untouched position; force: (K, 3) N, object on sensor; normal_force: (K,) N, component along -normal;
    state: (K,) uint8, NON_CONTACT, STICKING, SLIPPING or UNKNOWN. Raises BadArgument where shapes differ.
    """

    shape: tuple[int, int]
    xyz: np.ndarray
    normal: np.ndarray
    displacement: np.ndarray
    force: np.ndarray
    normal_force: np.ndarray
    state: np.ndarray

    def __post_init__(self):
        count = self.shape[0] * self.shape[1]
        for name, shape in (*((name, (count, 3)) for name in ('xyz', 'normal', 'displacement', 'force')),
                            *((name, (count,)) for name in ('normal_force', 'state'))):
            if np.shape(getattr(self, name)) != shape:
                raise BadArgument(f'surface points: {name} must be {shape} for {self.shape[0]} x {self.shape[1]} points, got '
                                  f'{np.shape(getattr(self, name))}')


def dot_points(shape: tuple[int, int], xyz: np.ndarray, rest: np.ndarray, state: np.ndarray, force: np.ndarray | None) -> SurfacePoints:
    """Surface points of K dots at xyz (K, 3) m, untouched at rest (K, 3) m, with states (K,); force: (K, 3) N, None: unknown."""
    normal = grid_normals(xyz.reshape(*shape, 3)).reshape(-1, 3) if min(shape) > 1 else scattered_normals(xyz)
    force = np.full(xyz.shape, np.nan) if force is None else force
    return SurfacePoints(shape, xyz, normal, xyz - rest, force, -np.einsum('kc,kc->k', force, normal), state)


def scattered_normals(xyz: np.ndarray) -> np.ndarray:
    """(K, 3) unit normals, z upwards, of the surface through xyz (K, 3): of the least-squares plane through a point and its nearest
    neighbours (Hoppe et al. 1992, section 3.1). NaN for a NaN point, and for too few points.
    """
    normal = np.full(xyz.shape, np.nan)
    known = np.flatnonzero(np.isfinite(xyz).all(axis=1))
    if len(known) < _MIN_POINTS:
        return normal
    positions = xyz[known]
    from scipy.spatial import cKDTree  # needed only for points
    _, near = cKDTree(positions).query(positions, min(_NEIGHBOURS + 1, len(known)))
    offsets = positions[near] - positions[near].mean(axis=1, keepdims=True)
    least = np.linalg.eigh(np.einsum('kni,knj->kij', offsets, offsets))[1][:, :, 0]
    normal[known] = least * np.where(least[:, 2:] < 0, -1.0, 1.0)
    return normal
