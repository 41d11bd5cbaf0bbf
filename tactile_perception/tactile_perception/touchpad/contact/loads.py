# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The object's load on each dot from the dots' places: what the membrane's elastic force and the fluid's pressure leave over.

The places are those of the membrane solved in one frame (surface.membrane), so that one evaluation of its forces is enough; and where no
dot is off its rest place by enough to carry a load, not even that.
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

# Load, to first order and as a share of the fluid's pressure, under which all dots are taken to be free: half of it is a touch.
_QUIET = 0.3
# What the mesh leaves over on a free dot, as a share of the fluid's pressure, in each round that finds this.
_PRESSURE_ROUNDS = (.3, .1, .06)
_LEAST_PRESSURE = 0.1
# Load from which an unseen dot, or one beside it, has to be placed by the balance. Misfit allowed there; how loosely these dots are held
# to where their neighbours have them, and how far they go, m.
_CALM_LOAD, _FILL_MISFIT, _FILL_HOLD, _FILL_STEP = 0.25, 0.4, 1e-3, 4e-4


@dataclass(frozen=True)
class DotLoads:
    """All K dots of the grid in one frame, in the order of their numbers (unseen ones as the membrane has them).

    xyz: (K, 3) m, sensor frame; seen: (K,) bool; normal: (K, 3) outward; force: (K, 3) N, object on sensor, 0 on the outermost dots, which
    have no balance; load: (K,) the object's pressure over the fluid's: 0 free, 1 under a flat face.
    """

    xyz: np.ndarray
    seen: np.ndarray
    normal: np.ndarray
    force: np.ndarray
    load: np.ndarray

    def wrench(self, carries: np.ndarray) -> np.ndarray:
        """(6,) force, N, and moment about the sensor's origin, N m, that the object exerts through dots carries (K,), 1 or 0."""
        force = self.force * carries[:, None]
        turn = self.xyz.T @ force
        moment = turn[1, 2] - turn[2, 1], turn[2, 0] - turn[0, 2], turn[0, 1] - turn[1, 0]
        return np.array([*(carries @ self.force), *moment])


class LoadEstimator:
    """The balance of a rows x columns grid of dots in a membrane of this material, seen by a camera with its centre at origin (3,), m."""

    def __init__(self, rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray):
        self.shape, self._material, self._origin = (rows, columns), material, np.asarray(origin, float)
        self._slopes: np.ndarray | None = None
        self._linear: sparse.csr_matrix | None = None
        self.membrane: Membrane | None = None

    def renew(self, rest_xyz: np.ndarray) -> None:
        """Take the dots' rest places (K, 3), m; NaN: not known. Raises BadArgument where less than half are known."""
        self.membrane = self.membrane.with_rest(rest_xyz) if self.membrane else Membrane(rest_xyz, *self.shape, self._material)
        if self._linear is None:
            self._slopes = self._slopes_at_rest()
            self._linear = self._linear_loads()

    def displacements(self, ids: np.ndarray, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far all dots are from their rest places (K, 3), m, by places xyz (N, 3) of those seen, ids (N,), and which these are (K,)
        bool; the others moved as their neighbours. Raises BadArgument for ids outside the grid.
        """
        mesh, rest = self.membrane.mesh, self.membrane.rest
        if len(ids) and (ids.min() < 0 or ids.max() >= mesh.size):
            raise BadArgument(f'balance: dot numbers {ids.min()} to {ids.max()} are outside the grid of {mesh.size} dots; '
                              'check parameters rows and columns')
        seen, moved = np.zeros(mesh.size, bool), np.zeros_like(rest)
        seen[ids] = True
        moved[ids] = xyz - rest[ids]
        return (moved if seen.all() else mesh.fill(moved, seen)), seen

    def unloaded(self, moved: np.ndarray) -> bool:
        """Whether dots that have moved (K, 3), m, from rest carry no load that could be a touch, to first order."""
        load = self._linear @ moved.ravel()
        return bool(max(load.max(), -load.min()) < _QUIET)

    def loads(self, moved: np.ndarray, seen: np.ndarray) -> DotLoads:
        """The loads on dots that have moved (K, 3), m, from rest; where unseen ones may carry some, they go a step towards the balance."""
        places = np.ascontiguousarray((self.membrane.rest + moved).T)
        found = self._evaluate(places, seen)
        if seen.all() or not (np.abs(found.load[self.membrane.mesh.stencil[:, ~seen]]) > _CALM_LOAD).any():
            return found
        return self._evaluate(self._settled(places, found), seen)

    def _slopes_at_rest(self) -> np.ndarray:
        """(9, K, 3) 1/m: how the load on each dot changes as a dot of its stencil moves, around rest; 0 on the outermost."""
        mesh, pressure = self.membrane.mesh, self._material.rest_pressure
        rest, found = np.ascontiguousarray(self.membrane.rest.T), np.empty((9, mesh.size, 3))
        for axis in range(3):
            along = np.repeat(np.eye(3)[:, [axis]], mesh.size, axis=1)
            _, slopes, _, _, area = self.membrane.forces.along_rays(rest, along, pressure)
            found[..., axis] = np.where(mesh.inner, slopes / (pressure * area), 0.0)
        return found

    def _linear_loads(self) -> sparse.csr_matrix:
        """(K, 3 K): each dot's load over the fluid's pressure by movements of the dots, m, to first order around rest."""
        mesh = self.membrane.mesh
        row = np.broadcast_to(np.arange(mesh.size)[:, None], self._slopes.shape)
        column = 3 * mesh.stencil[:, :, None] + np.arange(3)
        matrix = sparse.csr_matrix((self._slopes.ravel(), (row.ravel(), column.ravel())), shape=(mesh.size, 3 * mesh.size))
        matrix.eliminate_zeros()
        return matrix

    def _evaluate(self, places: np.ndarray, seen: np.ndarray) -> DotLoads:
        """The loads at places (3, K), m, of which dots seen (K,) bool were measured."""
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
        """Pressure, Pa, from what each inner dot would need to be free, wanted (N,): that of those which agree on it."""
        least = _LEAST_PRESSURE * self._material.rest_pressure
        middle = len(wanted) // 2
        pressure = max(float(np.partition(wanted, middle)[middle]), least)
        for misfit in _PRESSURE_ROUNDS:
            weight = 1 / (1 + ((wanted / pressure - 1) / misfit)**2)**2
            pressure = max(float(weight @ wanted / weight.sum()), least)
        return pressure

    def _settled(self, places: np.ndarray, found: DotLoads) -> np.ndarray:
        """places (3, K), m, with unseen dots moved along their rays by one step towards the balance of themselves and those around."""
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
        normal = matrix.T @ (weight[:, None] * matrix) + np.eye(len(holes)) / _FILL_HOLD**2
        change = -np.linalg.solve(normal, matrix.T @ pull)
        places = places.copy()
        places[:, holes] += np.clip(change, -_FILL_STEP, _FILL_STEP) * rays
        return places
