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

from ...errors import BadArgument
from .forces import MembraneForces, MembraneMaterial
from .mesh import GridMesh
from .range_scale import RangeScale
from .step import MembraneFrame, Slopes

# Standard deviation of a free dot's residual load (over the fluid's pressure) in each step of a cold start. Chosen: from loose to the
# mesh's discretisation error.
_COLD = (1.0, .7, .4, .25, .15, .2)
#: The same for each iteration from the last frame's state, by name: 'fast' is less certain of small and new contacts.
PACES = {'full': (.4, .2), 'fast': (.4,)}
_KNOWN = 3e-6  # m, standard deviation of a range that counts as known; chosen
_MOST = 4096  # dots, 64 x 64; chosen for memory: the response is a dense K x K matrix (64 MB)


@dataclass(frozen=True)
class MembraneState:
    """The membrane in one frame: all K dots of the grid in the order of their numbers, unseen ones interpolated.

    places: (3, K) m, sensor frame; ranges: (K,) m from the camera's centre; touched: (K,) probability that the dot carries a load;
    fluid_pressure: Pa; seen: (K,) bool.
    """

    places: np.ndarray
    ranges: np.ndarray
    touched: np.ndarray
    fluid_pressure: float
    seen: np.ndarray

    @property
    def xyz(self) -> np.ndarray:
        """(K, 3) m, sensor frame."""
        return self.places.T


class Membrane:
    """The membrane between the dots of a rows x columns grid with rest positions rest_xyz (K, 3), m, in the order of their numbers.

    NaN rows of rest_xyz (dots missing from the reference) are interpolated. pace: a name in PACES. Raises BadArgument for a wrong shape,
    too many dots, an unknown pace, or less than half of the rest positions.
    """

    def __init__(self, rest_xyz: np.ndarray, rows: int, columns: int, material: MembraneMaterial | None = None, pace: str = 'full'):
        if pace not in PACES:
            raise BadArgument(f'membrane: pace {pace!r} is unknown; choose one of {", ".join(PACES)}')
        self.pace = pace
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
        self._slopes = Slopes(self.forces)
        self._response = None
        self.pitch = float(np.median(np.linalg.norm(np.diff(self.rest.reshape(rows, columns, 3), axis=1), axis=2)))

    def with_rest(self, rest_xyz: np.ndarray) -> Membrane:
        """The same membrane with other rest positions (K, 3), m, for a drifting reference; keeps the costly response matrix."""
        other = Membrane(rest_xyz, self.mesh.rows, self.mesh.columns, self.material, self.pace)
        other._response = self._response
        return other

    def solve(self, origin: np.ndarray, rays: np.ndarray, ranges: np.ndarray, sigma: np.ndarray, ids: np.ndarray,
              previous: MembraneState | None = None, steps: tuple[float, ...] | None = None,
              scale: RangeScale | None = None) -> MembraneState:
        """The state from measured ranges (N,) m along unit rays (N, 3) from origin (3,) to the dots ids (N,).

        sigma: (N,) m, independent error of each range, without the errors that neighbours share; a NaN range is interpolated. previous: the
        last frame's state, to start from. steps: standard deviation of a free dot's load in each step, instead of the pace's. scale: common
        scale error of the ranges; it is applied and updated. Raises BadArgument for ids outside the grid.
        """
        ids = _checked_ids(ids, self.mesh.size)
        start, touched, pressure = (self.rest.T, None, self.material.rest_pressure) if previous is None else (
            previous.places, previous.touched, previous.fluid_pressure)
        rest = np.sqrt(np.square(self.rest - origin).sum(1)) if scale is not None else None
        if scale is not None:
            ranges = scale.correct(ranges, rest[ids])
        frame = MembraneFrame(self.forces, self._slopes, origin, rays, ranges, sigma, ids, start, touched, pressure)
        frame.variance = self._load_variance(frame)
        schedule = steps or (_COLD if frame.cold else PACES[self.pace])
        for index, misfit in enumerate(schedule):
            final = index == len(schedule) - 1
            frame.step(misfit, classify=index > 0 or not frame.cold, robust=index > 0 or final, final=final)
        if scale is not None:
            scale.learn(frame, rest)
        return MembraneState(frame.places, frame.ranges, frame.touched, frame.pressure, frame.seen)

    def _load_variance(self, frame: MembraneFrame) -> np.ndarray:
        """Variance (K,) of each dot's load over the fluid's pressure from the range errors, all other loads known."""
        if self._response is None:
            self._response = self._squared_response(frame.rays)
        return 1 / np.maximum(self._response @ np.float32(frame.weight), np.float32(1e-3))

    def _squared_response(self, rays: np.ndarray) -> np.ndarray:
        """(K, K) m^2: information about one dot's load (rows), in fluid pressures, from each dot's range (columns) at unit weight.

        It is the squared displacement along the rays under that load alone, reduced by what the outermost dots, which have no balance,
        can compensate.
        """
        rest = np.ascontiguousarray(self.rest.T)
        _, slopes, _, _, area = self.forces.along_rays(rest, rays, self.material.rest_pressure)
        size, inner = self.mesh.size, np.flatnonzero(self.mesh.inner)
        dense = np.zeros((size, size))
        dense[np.arange(size)[None], self.mesh.stencil] = slopes
        rows = dense[inner] / (self.material.rest_pressure * area[inner])[:, None]
        squared = np.zeros((size, size))
        squared[np.ix_(inner, inner)] = np.linalg.inv(rows[:, inner]).T**2
        # posterior variance of each load with all others nearly fixed, then without its own balance
        stiff = 1e-3 * np.sqrt(squared[inner].sum(1).min())**-1 * _KNOWN
        posterior = np.einsum('ij,ji->i', rows, np.linalg.solve(np.eye(size) / _KNOWN**2 + rows.T @ rows / stiff**2, rows.T))
        alone = 1 / (1 / posterior - 1 / stiff**2) / _KNOWN**2
        squared[inner] /= (alone * squared[inner].sum(1))[:, None]
        return squared.astype(np.float32)


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
