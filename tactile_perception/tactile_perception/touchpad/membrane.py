# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dot positions from measured ranges, regularised by the membrane's force balance.

Off contact the membrane's elastic force and the fluid's pressure cancel; in contact the residual is the object's pressure. Each dot is free
(residual: the mesh's discretisation error) or touched (residual: roughly the fluid's pressure): a mixture model with coupled neighbours,
solved by reweighted Gauss-Newton steps in the ranges, each one banded Cholesky solve. It assumes no object shape and no motion.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _core
from ..errors import BadArgument

_OFFSETS = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)]


class GridMesh:
    """Topology of a rows x columns grid of dots, K = rows * columns, dot k = row * columns + column.

    stencil (K, 9): a dot and its neighbours row by row, itself in slot 4 and for missing neighbours; valid (K, 9): where they exist; inner
    (K,): dots with eight neighbours. Raises BadArgument for less than 3 x 3 dots.
    """

    def __init__(self, rows: int, columns: int):
        if rows < 3 or columns < 3:
            raise BadArgument(f'membrane: a grid of at least 3 x 3 dots is needed, got {rows} x {columns}; '
                              'check parameters rows and columns')
        self.rows, self.columns, self.size = rows, columns, rows * columns
        self.stencil, self.valid = self._stencil()
        self.inner = self.valid.all(axis=1)

    def _stencil(self) -> tuple[np.ndarray, np.ndarray]:
        row, column = np.divmod(np.arange(self.size), self.columns)
        near_row = np.stack([row + i for i, _ in _OFFSETS], axis=1)
        near_column = np.stack([column + j for _, j in _OFFSETS], axis=1)
        valid = (near_row >= 0) & (near_row < self.rows) & (near_column >= 0) & (near_column < self.columns)
        return np.where(valid, near_row * self.columns + near_column, np.arange(self.size)[:, None]), valid


@dataclass(frozen=True)
class MembraneState:
    """The membrane in one frame: all K dots of the grid in the order of their numbers, unseen ones interpolated.

    xyz: (K, 3) m, sensor frame; ranges: (K,) m from the camera's centre; touched: (K,) probability that the dot carries a load;
    fluid_pressure: Pa; seen: (K,) bool.
    """

    xyz: np.ndarray
    ranges: np.ndarray
    touched: np.ndarray
    fluid_pressure: float
    seen: np.ndarray


@dataclass(frozen=True)
class MembraneMaterial:
    """shear_stiffness: shear modulus times thickness, N/m; rest_pressure: gauge pressure of the fluid without contact, Pa;
    rest_curvature_radius: m.

    Raises BadArgument for a rest tension p R / 2 above shear_stiffness, which a neo-Hookean membrane cannot carry.
    """

    shear_stiffness: float = 90.0
    rest_pressure: float = 2000.0
    rest_curvature_radius: float = 0.020

    def __post_init__(self):
        if not (self.shear_stiffness > 0 and self.rest_pressure > 0 and 0 < self.rest_tension <= self.shear_stiffness):
            raise BadArgument(f'membrane: shear_stiffness {self.shear_stiffness} N/m, rest_pressure {self.rest_pressure} Pa and curvature '
                              f'radius {self.rest_curvature_radius} m need 0 < pressure * radius / 2 <= stiffness; check membrane.*')

    @property
    def rest_tension(self) -> float:
        """Tension at rest, N/m."""
        return self.rest_pressure * self.rest_curvature_radius / 2


class MembraneForces:
    """Nodal forces of a mesh with rest positions rest_xyz (K, 3), m.

    triangles: the kernels' description of the membrane at rest; rest_residual: (K, 3) m^2, the mesh's discretisation error at rest over
    the pressure, which is subtracted.
    """

    def __init__(self, mesh: GridMesh, rest_xyz: np.ndarray, material: MembraneMaterial):
        self.mesh, self.material = mesh, material
        self._grid = {'rows': mesh.rows, 'columns': mesh.columns}
        rest = np.ascontiguousarray(rest_xyz, float)
        self.triangles = _core.membrane_at_rest(rest, stiffness=material.shear_stiffness,
                                                area_share=1 - material.rest_tension / material.shear_stiffness, **self._grid)
        elastic, share = self.elastic(rest)
        self.rest_residual = share + elastic / material.rest_pressure

    def elastic(self, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force of the membrane alone on each dot (K, 3), N, and the dots' area vectors (K, 3), m^2, at places xyz (K, 3), m."""
        return _core.membrane_forces(xyz, self.triangles, **self._grid)

    def slopes(self, xyz: np.ndarray, rays: np.ndarray, pressure: float) -> np.ndarray:
        """(K, 9) 1/m, in stencil order: derivatives of the normal load over pressure, Pa, by movements of the dots at xyz (K, 3) along
        their unit rays (K, 3), normals held."""
        return _core.membrane_slopes(xyz, rays, self.triangles, self.rest_residual, pressure=pressure, **self._grid)

    def scale_leaning(self, state: MembraneState, rays: np.ndarray, moved: np.ndarray, lifted: float,
                      **numbers: float) -> tuple[float, float]:
        """Sums of r'^2 and r r' over free dots, r: residual force along the surface over the pressure, r': its derivative by the scale.

        state: of the frame, along unit rays (K, 3); moved: (K,) m, lifted: Pa, as of RangeScale.learn; numbers: step of the scale, spread
        of a free dot's r, scale. Kernel: src/touchpad/membrane/membrane_frame.cpp.
        """
        return _core.scale_leaning(state.xyz, rays, state.touched, moved, self.triangles, self.rest_residual, lifted=lifted,
                                   pressure=state.fluid_pressure, **numbers, **self._grid)


_FAR_ENOUGH, _FAR_SHARE = 0.5e-3, 0.02  # m; chosen: update only while more than this share of the dots is displaced by more
_TRIAL = 0.01  # relative step of the finite difference; chosen
# Standard deviation of a free dot's tangential residual (over the fluid's pressure) from other causes, and the number of dots and frames
# over which such a cause is correlated; chosen.
_RESIDUAL, _CORRELATED = 0.2, 50.0
_FINEST = 0.008  # smallest standard deviation; chosen for the mesh's discretisation error
_LARGEST = 0.2  # largest factor and step; chosen


class RangeScale:
    """Factor 1 + value on displacements along the rays; sigma: prior standard deviation of value (0: value is fixed)."""

    def __init__(self, sigma: float = 0.05, value: float = 0.0):
        self.value, self.sigma = value, sigma
        self._precision = 1 / sigma**2 if sigma > 0 else np.inf

    @property
    def factor(self) -> float:
        """Factor on measured ranges less those at rest."""
        return 1 + self.value

    def learn(self, forces: MembraneForces, state: MembraneState, rays: np.ndarray, displaced: np.ndarray, moved: np.ndarray,
              lifted: float) -> None:
        """Update the factor from a solved frame.

        rays: (K, 3) unit; displaced: (K,) m, measured ranges less those at rest; moved: (K,) m, lifted: Pa, what ranges and pressure would
        change by if all were displaced twice as far.
        """
        if self._precision == np.inf:
            return
        if np.count_nonzero(np.abs(displaced) > _FAR_ENOUGH) <= _FAR_SHARE * len(displaced):
            return
        curvature, gradient = forces.scale_leaning(state, rays, moved, lifted, step=_TRIAL, spread=_RESIDUAL, scale=self.factor)
        information = curvature / _RESIDUAL**2 / _CORRELATED
        if information > 0:
            best = -gradient / curvature
            self._precision = min(self._precision + information, 1 / _FINEST**2)
            share = information / self._precision
            self.value = min(max(float(self.value + share * min(max(best, -_LARGEST), _LARGEST)), -_LARGEST), _LARGEST)


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
