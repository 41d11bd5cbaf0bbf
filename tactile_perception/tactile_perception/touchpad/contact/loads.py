# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The object's load on each dot: the residual of the membrane's elastic force and the fluid's pressure at the dots' positions.

The tracker has solved these positions (membrane.solver), so one evaluation of the forces is enough; a linear test spares it in frames
without contact. Loads are evaluated here alone, from `dots` as published: one process or several, live or recorded, the results are equal.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ...common.vectors import dot
from ...errors import BadArgument
from ..membrane.forces import MembraneMaterial
from ..membrane.load import contact_probability, expectation, log_likelihood_ratio
from ..membrane.solver import Membrane

# Loads below are over the fluid's pressure; a dot in contact has more than 0.5.
_UNLOADED = 0.3  # linearised load below which every dot counts as free; chosen
_PRESSURE_ROUNDS = (.3, .1, .06)  # scale of a free dot's load in each round of reweighting; chosen, down to the discretisation error
_LEAST_PRESSURE = 0.1  # of the rest pressure; chosen
# Unseen dots are placed by the balance where they or neighbours carry more than this load; standard deviations of a free dot's load and
# of the interpolated position (m), largest step (m); chosen.
_FILL_LOAD, _FILL_MISFIT, _FILL_SIGMA, _FILL_STEP = 0.25, 0.4, 1e-3, 4e-4


@dataclass(frozen=True)
class DotLoads:
    """Loads on all K dots of the grid in one frame, in the order of their numbers; unseen dots are interpolated.

    xyz: (K, 3) m, sensor frame; seen: (K,) bool; normal: (K, 3) outward; force: (K, 3) N, object on sensor, 0 on the outermost dots, which
    have no balance; load: (K,) normal pressure of the object over the fluid's: 0 free, 1 under a flat face.
    """

    xyz: np.ndarray
    seen: np.ndarray
    normal: np.ndarray
    force: np.ndarray
    load: np.ndarray

    def wrench(self, carries: np.ndarray) -> np.ndarray:
        """(6,) force, N, and moment about the sensor's origin, N m, of the object on the dots where carries (K,) is 1, not 0."""
        force = self.force * carries[:, None]
        turn = self.xyz.T @ force
        moment = turn[1, 2] - turn[2, 1], turn[2, 0] - turn[0, 2], turn[0, 1] - turn[1, 0]
        return np.array([*(carries @ self.force), *moment])


class LoadEstimator:
    """Loads on a rows x columns grid of dots in a membrane of this material; origin: (3,) m, camera centre."""

    def __init__(self, rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray):
        self.shape, self._material, self._origin = (rows, columns), material, np.asarray(origin, float)
        self._slopes: np.ndarray | None = None
        self._linear: sparse.csr_matrix | None = None
        self.membrane: Membrane | None = None

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Set the dots' rest positions (K, 3), m; NaN: unknown. Raises BadArgument if less than half are known."""
        self.membrane = self.membrane.with_rest(rest_xyz) if self.membrane else Membrane(rest_xyz, *self.shape, self._material)
        if self._linear is None:
            self._slopes = self._slopes_at_rest()
            self._linear = self._linear_loads()

    def displacements(self, ids: np.ndarray, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacements (K, 3), m, of all dots from rest, and which are seen (K,) bool; from positions xyz (N, 3), m, of the seen dots ids
        (N,). Unseen dots are interpolated. Raises BadArgument for ids outside the grid.
        """
        mesh, rest = self.membrane.mesh, self.membrane.rest
        if len(ids) and (ids.min() < 0 or ids.max() >= mesh.size):
            raise BadArgument(f'loads: dot numbers {ids.min()} to {ids.max()} are outside the grid of {mesh.size} dots; '
                              'check parameters rows and columns')
        seen, moved = np.zeros(mesh.size, bool), np.zeros_like(rest)
        seen[ids] = True
        moved[ids] = xyz - rest[ids]
        return (moved if seen.all() else mesh.fill(moved, seen)), seen

    def unloaded(self, moved: np.ndarray) -> bool:
        """Whether no dot carries a significant load, to first order; moved: (K, 3) m, displacements."""
        load = self._linear @ moved.ravel()
        return bool(max(load.max(), -load.min()) < _UNLOADED)

    def loads(self, moved: np.ndarray, seen: np.ndarray) -> DotLoads:
        """Loads for displacements moved (K, 3), m; seen: (K,) bool. Unseen dots near a load are placed by one step towards the balance."""
        places = np.ascontiguousarray((self.membrane.rest + moved).T)
        found = self._evaluate(places, seen)
        if seen.all() or not (np.abs(found.load[self.membrane.mesh.stencil[:, ~seen]]) > _FILL_LOAD).any():
            return found
        return self._evaluate(self._settled(places, found), seen)

    def _slopes_at_rest(self) -> np.ndarray:
        """(9, K, 3) 1/m: derivatives of each dot's load by the positions of its stencil, at rest; 0 on the outermost dots."""
        mesh, pressure = self.membrane.mesh, self._material.rest_pressure
        rest, found = np.ascontiguousarray(self.membrane.rest.T), np.empty((9, mesh.size, 3))
        for axis in range(3):
            along = np.repeat(np.eye(3)[:, [axis]], mesh.size, axis=1)
            _, slopes, _, _, area = self.membrane.forces.along_rays(rest, along, pressure)
            found[..., axis] = np.where(mesh.inner, slopes / (pressure * area), 0.0)
        return found

    def _linear_loads(self) -> sparse.csr_matrix:
        """(K, 3 K) 1/m: the same as a sparse matrix."""
        mesh = self.membrane.mesh
        row = np.broadcast_to(np.arange(mesh.size)[:, None], self._slopes.shape)
        column = 3 * mesh.stencil[:, :, None] + np.arange(3)
        matrix = sparse.csr_matrix((self._slopes.ravel(), (row.ravel(), column.ravel())), shape=(mesh.size, 3 * mesh.size))
        matrix.eliminate_zeros()
        return matrix

    def _evaluate(self, places: np.ndarray, seen: np.ndarray) -> DotLoads:
        """Loads at positions places (3, K), m; seen: (K,) bool."""
        forces, inner = self.membrane.forces, self.membrane.mesh.inner
        elastic, share = forces.elastic(places)
        square = dot(share, share)
        push = square - dot(forces.rest_residual, share)
        carried = -dot(elastic, share)
        pressure = self._fluid_pressure((carried / push)[inner])
        load = np.where(inner, (pressure * push - carried) / (pressure * square), 0.0)
        force = np.where(inner, pressure * (forces.rest_residual - share) - elastic, 0.0)
        return DotLoads(places.T.copy(), seen, (share / np.sqrt(square)).T.copy(), force.T.copy(), load)

    def _fluid_pressure(self, wanted: np.ndarray) -> float:
        """Pressure, Pa: robust mean of the pressures wanted (N,) at which each inner dot would be free."""
        least = _LEAST_PRESSURE * self._material.rest_pressure
        middle = len(wanted) // 2
        pressure = max(float(np.partition(wanted, middle)[middle]), least)
        for misfit in _PRESSURE_ROUNDS:
            weight = 1 / (1 + ((wanted / pressure - 1) / misfit)**2)**2
            pressure = max(float(weight @ wanted / weight.sum()), least)
        return pressure

    def _settled(self, places: np.ndarray, found: DotLoads) -> np.ndarray:
        """places (3, K), m, with unseen dots moved along their rays by one Gauss-Newton step towards the balance around them."""
        mesh, holes = self.membrane.mesh, np.flatnonzero(~found.seen)
        away = places[:, holes] - self._origin[:, None]
        rays = away / np.sqrt(dot(away, away))
        around = np.unique(mesh.stencil[:, holes])
        around = around[mesh.inner[around]]
        slot, row = np.nonzero(~found.seen[mesh.stencil[:, around]])
        hole = np.searchsorted(holes, mesh.stencil[slot, around[row]])
        matrix = np.zeros((len(around), len(holes)))
        matrix[row, hole] = np.einsum('nc,cn->n', self._slopes[slot, around[row]], rays[:, hole])
        touched = contact_probability(mesh, log_likelihood_ratio(found.load, _PRESSURE_ROUNDS[-1]), (found.load > .5).astype(float))
        weight, pull = expectation(found.load[around], touched[around], _FILL_MISFIT)
        normal = matrix.T @ (weight[:, None] * matrix) + np.eye(len(holes)) / _FILL_SIGMA**2
        change = -np.linalg.solve(normal, matrix.T @ pull)
        places = places.copy()
        places[:, holes] += np.clip(change, -_FILL_STEP, _FILL_STEP) * rays
        return places
