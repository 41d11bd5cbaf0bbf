# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A sensor's surface as points: position, displacement, force and contact state of each dot or taxel."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.errors import BadArgument
from .constants import COMMON
from .surface import grid_normals

NON_CONTACT, STICKING, SLIPPING = range(3)  # states of tactile_msgs/ContactRegion
UNKNOWN = np.iinfo(np.uint8).max


@dataclass(frozen=True)
class SurfacePoints:
    """Points of a sensor's surface in the order of their numbers, in the sensor frame; unknown is NaN.

    Parameters
    ----------
    shape : tuple of int
        Rows and columns of the grid, row by row; (1, K) without a grid.
    xyz, normal : ndarray, shape (K, 3)
        Position in m, and unit normal out of the sensor.
    displacement : ndarray, shape (K, 3)
        From the undeformed position, in m.
    force : ndarray, shape (K, 3)
        Of the object on the sensor, in N.
    normal_force : ndarray, shape (K,)
        Component along minus the normal, in N.
    state : ndarray of uint8, shape (K,)
        NON_CONTACT, STICKING, SLIPPING or UNKNOWN.

    Raises
    ------
    BadArgument
        If the shapes differ.
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
            if getattr(self, name).shape != shape:
                raise BadArgument(f'surface points: {name} must be {shape} for {self.shape[0]} x {self.shape[1]} points, got '
                                  f'{getattr(self, name).shape}')


def dot_points(shape: tuple[int, int], xyz: np.ndarray, rest: np.ndarray, state: np.ndarray, force: np.ndarray | None) -> SurfacePoints:
    """Surface points of dots.

    Parameters
    ----------
    shape : tuple of int
        Rows and columns of the grid; (1, K) without a grid.
    xyz, rest : ndarray, shape (K, 3)
        Present and undeformed positions in m.
    state : ndarray, shape (K,)
        Contact state of each dot.
    force : ndarray, shape (K, 3), or None
        In N; None: unknown.

    Returns
    -------
    SurfacePoints
    """
    normal = grid_normals(xyz.reshape(*shape, 3)).reshape(-1, 3) if min(shape) > 1 else scattered_normals(xyz)
    if force is None:
        force, normal_force = np.full(xyz.shape, np.nan), np.full(len(xyz), np.nan)
    else:
        normal_force = -np.einsum('kc,kc->k', force, normal)
    return SurfacePoints(shape, xyz, normal, xyz - rest, force, normal_force, state)


def scattered_normals(xyz: np.ndarray) -> np.ndarray:
    """Estimate the unit normals of the surface through scattered points.

    Parameters
    ----------
    xyz : ndarray, shape (K, 3)
        Points.

    Returns
    -------
    ndarray, shape (K, 3)
        Normals, z upwards; NaN for a NaN point, and for too few points.

    Notes
    -----
    The normal is that of the least-squares plane through a point and its nearest neighbours (Hoppe et al. 1992, section 3.1).
    """
    normal = np.full(xyz.shape, np.nan)
    known = np.flatnonzero(np.isfinite(xyz).all(axis=1))
    if len(known) < COMMON.min_points:
        return normal
    positions = xyz[known]
    from scipy.spatial import cKDTree  # needed only for points
    _, near = cKDTree(positions).query(positions, min(COMMON.neighbours + 1, len(known)))
    offsets = positions[near] - positions[near].mean(axis=1, keepdims=True)
    least = np.linalg.eigh(np.einsum('kni,knj->kij', offsets, offsets))[1][:, :, 0]
    normal[known] = least * np.where(least[:, 2:] < 0, -1.0, 1.0)
    return normal
