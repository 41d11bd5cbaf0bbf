# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Places of the dots and the load on them, solved together: what is measured along the rays and what a membrane can do.

Off contact the membrane's elastic force and the fluid's pressure cancel; in contact what is left over is the object's pressure. Each dot is
free (nothing left over but the mesh's misfit) or touched (a pressure about the fluid's own, loosely): a mixture with neighbours coupled,
solved by reweighted Gauss-Newton steps in the dots' ranges, each one banded Cholesky solve. No tool shape, no motion, no history enters.
"""
from __future__ import annotations

import numpy as np

from ...errors import BadArgument
from .forces import MembraneForces, MembraneMaterial
from .mesh import GridMesh
from .range_scale import RangeScale
from .state import MembraneState
from .step import MembraneFrame, Slopes

# What the mesh leaves over on a free dot, as a share of the fluid's pressure, in each step: with nothing to start from, and from the last
# frame.
_COLD = (1.0, .7, .4, .25, .15, .2)
#: Steps from one frame to the next by name of the pace: what is fast is a little less sure of small and new contacts.
PACES = {'full': (.4, .2), 'fast': (.4,)}
# m: standard deviation of a range that is as good as known.
_KNOWN = 3e-6
_MOST = 4096  # dots: how each range tells of each load is a matrix of their number squared


class Membrane:
    """The membrane between the dots of a rows x columns grid that rest at rest_xyz (K, 3), m, in the order of their numbers.

    Rows of NaN in rest_xyz (dots that the reference did not see) are filled in from their neighbours. pace: a name in PACES. Raises
    BadArgument for a wrong shape, too many dots, an unknown pace, or where less than half of the dots are known.
    """

    def __init__(self, rest_xyz: np.ndarray, rows: int, columns: int, material: MembraneMaterial | None = None, pace: str = 'full'):
        if pace not in PACES:
            raise BadArgument(f'membrane: pace {pace!r} is unknown; choose one of {", ".join(PACES)}')
        self.pace = pace
        self.mesh = GridMesh(rows, columns)
        if self.mesh.size > _MOST:
            raise BadArgument(f'membrane: {rows} x {columns} dots are more than the {_MOST} that it can be solved for; '
                              'check rows and columns')
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
        """The same membrane with other rest places (K, 3), m, of its dots, for a reference that drifts: what is costly to find is kept."""
        other = Membrane(rest_xyz, self.mesh.rows, self.mesh.columns, self.material, self.pace)
        other._response = self._response
        return other

    def solve(self, origin: np.ndarray, rays: np.ndarray, ranges: np.ndarray, sigma: np.ndarray, ids: np.ndarray,
              previous: MembraneState | None = None, steps: tuple[float, ...] | None = None,
              scale: RangeScale | None = None) -> MembraneState:
        """The membrane from measured ranges (N,) m +- sigma (N,) m along unit rays (N, 3) from origin (3,) to the dots numbered ids (N,).

        sigma is each range's own error; errors that neighbours share (of the optics' calibration) do not belong in it: they bend nothing.
        A range that is NaN is left to the membrane. previous: the last frame's result, to start from. steps: the misfit allowed on free
        dots in each step (more and smaller: closer to the answer), instead of the pace's. scale: the factor that the ranges share, used and
        learnt. Raises BadArgument for ids outside the grid.
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
            frame.step(misfit, renew=index > 0 or not frame.cold, doubt=index > 0 or final, final=final)
        state = MembraneState(self.forces, frame.places, frame.ranges, frame.touched, frame.pressure, frame.seen)
        if scale is not None:
            scale.learn(frame, state, rest)
        return state

    def _load_variance(self, frame: MembraneFrame) -> np.ndarray:
        """Variance (K,) of a dot's load over the fluid's pressure, were it the only one unknown, by errors of the ranges."""
        if self._response is None:
            self._response = self._squared_response(frame.rays)
        return 1 / np.maximum(self._response @ np.float32(frame.weight), np.float32(1e-3))

    def _squared_response(self, rays: np.ndarray) -> np.ndarray:
        """(K, K) m^2: information about the load on one dot (rows), in fluid pressures, that each dot's range (columns) gives at unit
        weight.

        It is the square of how far the dots move along their rays under that load alone, less what the outermost dots, which no balance
        holds, could make of it.
        """
        rest = np.ascontiguousarray(self.rest.T)
        _, slopes, _, _, area = self.forces.along_rays(rest, rays, self.material.rest_pressure)
        size, inner = self.mesh.size, np.flatnonzero(self.mesh.inner)
        dense = np.zeros((size, size))
        dense[np.arange(size)[None], self.mesh.stencil] = slopes
        rows = dense[inner] / (self.material.rest_pressure * area[inner])[:, None]
        squared = np.zeros((size, size))
        squared[np.ix_(inner, inner)] = np.linalg.inv(rows[:, inner]).T**2
        # posterior variance of each load with all others nearly fixed, and with its own balance taken out again
        stiff = 1e-3 * np.sqrt(squared[inner].sum(1).min())**-1 * _KNOWN
        posterior = np.einsum('ij,ji->i', rows, np.linalg.solve(np.eye(size) / _KNOWN**2 + rows.T @ rows / stiff**2, rows.T))
        alone = 1 / (1 / posterior - 1 / stiff**2) / _KNOWN**2
        squared[inner] /= (alone * squared[inner].sum(1))[:, None]
        return squared.astype(np.float32)


def _checked_ids(ids: np.ndarray, size: int) -> np.ndarray:
    ids = np.asarray(ids, int)
    if len(ids) and (ids.min() < 0 or ids.max() >= size):
        raise BadArgument(f'membrane: dot numbers {ids.min()} to {ids.max()} are outside the grid of {size} dots; '
                          'check dots.rows and dots.columns')
    return ids


def fill_rest(mesh: GridMesh, rest: np.ndarray, known: np.ndarray) -> np.ndarray:
    """rest (K, 3) with unknown rows from a cubic surface over row and column fitted to the known ones."""
    if known.all():
        return rest
    row, column = np.divmod(np.arange(mesh.size), mesh.columns)
    y, x = 2 * row / (mesh.rows - 1) - 1, 2 * column / (mesh.columns - 1) - 1
    terms = np.stack([x**i * y**j for i in range(4) for j in range(4)], axis=1)
    fit = np.linalg.lstsq(terms[known], rest[known], rcond=None)[0]
    return np.where(known[:, None], rest, terms @ fit)
