# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The object's load on each dot: the residual of the membrane's elastic force and the fluid's pressure at the dots' positions.

The tracker has solved these positions (membrane.solver), so one evaluation of the forces is enough. Loads are evaluated here alone, from
`dots` as published: one process or several, live or recorded, the results are equal.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ... import _core
from ...errors import BadArgument
from ..membrane.forces import MembraneMaterial
from ..membrane.solver import Membrane

# Loads below are over the fluid's pressure; a dot in contact has more than 0.5.
_UNLOADED = 0.3  # load below which every dot counts as free; chosen
_LOADED = 0.5  # load above which a dot counts as loaded; chosen
_FILL_LOAD = 0.25  # unseen dots are placed by the balance where they or neighbours carry more than this; chosen


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

    @property
    def none(self) -> bool:
        """Whether no dot carries a significant load."""
        return bool(np.abs(self.load).max() < _UNLOADED)

    def carried(self, rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
        """Forces (K, 3), N, of the object on loaded dots and their neighbours, which have a part of a border's load, 0 on others; and their
        sum and moment about the sensor's origin (6,), N and N m. Kernel: src/touchpad/contact/carried_loads.cpp."""
        return _core.carried_loads(self.xyz, self.force, self.load, rows=rows, columns=columns, loaded=_LOADED)


class LoadEstimator:
    """Loads on a rows x columns grid of dots in a membrane of this material; origin: (3,) m, camera centre."""

    def __init__(self, rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray):
        self.shape, self._material, self._origin = (rows, columns), material, np.asarray(origin, float)
        self.membrane: Membrane | None = None

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Set the dots' rest positions (K, 3), m; NaN: unknown. Raises BadArgument if less than half are known."""
        self.membrane = self.membrane.with_rest(rest_xyz) if self.membrane else Membrane(rest_xyz, *self.shape, self._material)

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

    def loads(self, moved: np.ndarray, seen: np.ndarray) -> DotLoads:
        """Loads for displacements moved (K, 3), m; seen: (K,) bool. Unseen dots near a load are placed by one step towards the balance."""
        xyz = self.membrane.rest + moved
        found = DotLoads(xyz, seen, *self.membrane.forces.loads(xyz))
        if seen.all() or not (np.abs(found.load[self.membrane.mesh.stencil[~seen]]) > _FILL_LOAD).any():
            return found
        xyz = self._settled(found)
        return DotLoads(xyz, seen, *self.membrane.forces.loads(xyz))

    def _settled(self, found: DotLoads) -> np.ndarray:
        """(K, 3) m: places with unseen dots moved along their rays by one Gauss-Newton step towards the balance around them."""
        forces, (rows, columns) = self.membrane.forces, self.shape
        return _core.settle_holes(found.xyz, found.load, found.seen, forces.triangles, forces.rest_residual, self._origin, rows=rows,
                                  columns=columns, pressure=self._material.rest_pressure)
