# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dot positions from measured ranges, regularised by the membrane's force balance.

Off contact the membrane's elastic force and the fluid's pressure cancel; in contact the residual is the object's pressure. Each dot is free
(residual: the mesh's discretisation error) or touched (residual: roughly the fluid's pressure): a mixture model with coupled neighbours,
solved by reweighted Gauss-Newton steps in the ranges, each one banded Cholesky solve. It assumes no object shape and no motion.
"""
from __future__ import annotations

import numpy as np

from ... import _core
from ...errors import BadArgument
from .forces import MembraneForces, MembraneMaterial
from .mesh import GridMesh
from .range_scale import RangeScale
from .state import MembraneState

_MOST = 4096  # dots, 64 x 64; chosen for memory: the response is a dense matrix of the inner dots (64 MB)


class Membrane:
    """The membrane between the dots of a rows x columns grid with rest positions rest_xyz (K, 3), m, in the order of their numbers.

    NaN rows of rest_xyz (dots missing from the reference) are interpolated. Raises BadArgument for a wrong shape, too many dots, or less
    than half of the rest positions.
    """

    def __init__(self, rest_xyz: np.ndarray, rows: int, columns: int, material: MembraneMaterial | None = None):
        self.mesh = GridMesh(rows, columns)
        if self.mesh.size > _MOST:
            raise BadArgument(f'membrane: {rows} x {columns} dots are more than the maximum of {_MOST}; check rows and columns')
        self.material = material or MembraneMaterial()
        rest = np.asarray(rest_xyz, float)
        if rest.shape != (self.mesh.size, 3):
            raise BadArgument(f'membrane: rest_xyz must be ({self.mesh.size}, 3) for {rows} x {columns} dots, got {rest.shape}')
        known = np.isfinite(rest).all(1)
        if known.sum() < self.mesh.size / 2:
            raise BadArgument(f'membrane: only {known.sum()} of {self.mesh.size} dots have a rest place; take a new reference')
        self.rest = fill_rest(self.mesh, rest, known)
        self.forces = MembraneForces(self.mesh, self.rest, self.material)
        self._response = None
        self.pitch = float(np.median(np.linalg.norm(np.diff(self.rest.reshape(rows, columns, 3), axis=1), axis=2)))

    def with_rest(self, rest_xyz: np.ndarray) -> Membrane:
        """The same membrane with other rest positions (K, 3), m, for a drifting reference; keeps the costly response matrix."""
        other = Membrane(rest_xyz, self.mesh.rows, self.mesh.columns, self.material)
        other._response = self._response
        return other

    def solve(self, origin: np.ndarray, rays: np.ndarray, ranges: np.ndarray, sigma: np.ndarray, ids: np.ndarray,
              previous: MembraneState | None = None, scale: RangeScale | None = None) -> MembraneState:
        """The state from measured ranges (N,) m along unit rays (N, 3) from origin (3,) to the dots ids (N,).

        sigma: (N,) m, independent error of each range, without the errors that neighbours share; a NaN range is interpolated. previous: the
        last frame's state, to start from. scale: common scale error of the ranges; it is applied and updated. Raises BadArgument for ids
        outside the grid.
        """
        ids, origin = _checked_ids(ids, self.mesh.size), np.asarray(origin, float)
        if self._response is None:
            self._response = self._squared_response(origin)
        places, touched, pressure = (self.rest, np.zeros(self.mesh.size), self.material.rest_pressure) if previous is None else \
            (previous.xyz, previous.touched, previous.fluid_pressure)
        xyz, ranges, touched, pressure, seen, _, rays, displaced, moved, lifted = _core.solve_membrane(
            rays, ranges, sigma, ids, self.rest, places, touched, self.forces.triangles, self.forces.rest_residual, self._response, origin,
            rows=self.mesh.rows, columns=self.mesh.columns, pressure=pressure, scale=scale.factor if scale else 1.0, fresh=previous is None)
        state = MembraneState(xyz, ranges, touched, pressure, seen)
        if scale is not None:
            scale.learn(self.forces, state, rays, displaced, moved, lifted)
        return state

    def _squared_response(self, origin: np.ndarray) -> np.ndarray:
        """(I, I) m^2: information about one inner dot's load (columns), in fluid pressures, from each one's range (rows) at unit weight.

        It is the squared displacement along the rays from origin (3,) under that load alone, reduced by what the outermost dots, which have
        no balance, can compensate.
        """
        size, inner = self.mesh.size, np.flatnonzero(self.mesh.inner)
        away = self.rest - origin
        rays = away / np.linalg.norm(away, axis=1, keepdims=True)
        rows = np.zeros((len(inner), size))
        rows[np.arange(len(inner))[:, None], self.mesh.stencil[inner]] = self.forces.slopes(
            self.rest, rays, self.material.rest_pressure)[inner]
        squared = np.linalg.inv(rows[:, inner])**2
        stiff = 1e-6 / squared.sum(axis=0).min()  # variance of each load with all others nearly fixed, without its own balance
        alone = 1 / np.diag(np.linalg.inv(rows @ rows.T + stiff * np.eye(len(inner)))) - stiff
        return (squared / (alone * squared.sum(axis=0))).astype(np.float32)


def _checked_ids(ids: np.ndarray, size: int) -> np.ndarray:
    ids = np.asarray(ids, int)
    if len(ids) and (ids.min() < 0 or ids.max() >= size):
        raise BadArgument(f'membrane: dot numbers {ids.min()} to {ids.max()} are outside the grid of {size} dots; '
                          'check parameters rows and columns')
    return ids


def fill_rest(mesh: GridMesh, rest: np.ndarray, known: np.ndarray) -> np.ndarray:
    """rest (K, 3) with unknown rows from a bicubic polynomial in row and column, fitted to the known ones."""
    if known.all():
        return rest
    row, column = np.divmod(np.arange(mesh.size), mesh.columns)
    y, x = 2 * row / (mesh.rows - 1) - 1, 2 * column / (mesh.columns - 1) - 1
    terms = np.stack([x**i * y**j for i in range(4) for j in range(4)], axis=1)
    fit = np.linalg.lstsq(terms[known], rest[known], rcond=None)[0]
    return np.where(known[:, None], rest, terms @ fit)
