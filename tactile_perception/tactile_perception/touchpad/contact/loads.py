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
        """Forces (K, 3), N, of the object on loaded dots and, fading out, on those around, to which errors of the ranges move a part of a
        border's load, 0 on others; and their sum and moment about the sensor's origin (6,), N and N m.
        Kernel: src/touchpad/contact/carried_loads.cpp."""
        return _core.carried_loads(self.xyz, self.force, self.load, rows=rows, columns=columns, loaded=_LOADED)


class LoadEstimator:
    """Loads on a rows x columns grid of dots in a membrane of this material; origin: (3,) m, camera centre."""

    def __init__(self, rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray):
        self.shape, self._material, self._origin = (rows, columns), material, np.asarray(origin, float)
        self.membrane: Membrane | None = None

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Set the dots' rest positions (K, 3), m; NaN: unknown. Raises BadArgument if less than half are known."""
        self.membrane = self.membrane.with_rest(rest_xyz) if self.membrane else Membrane(rest_xyz, *self.shape, self._material)

    def loads(self, ids: np.ndarray, xyz: np.ndarray) -> DotLoads:
        """Loads from positions xyz (N, 3), m, of the seen dots ids (N,). Unseen dots are interpolated; near a load they are placed by one
        step towards the balance. Raises BadArgument for ids outside the grid. Kernel: src/touchpad/contact/seen_loads.cpp.
        """
        membrane, (rows, columns) = self.membrane, self.shape
        if len(ids) and not 0 <= ids.min() <= ids.max() < rows * columns:
            raise BadArgument(f'loads: dot numbers {ids.min()} to {ids.max()} are outside the grid of {rows * columns} dots; '
                              'check parameters rows and columns')
        return DotLoads(*_core.membrane_loads(
            ids, np.asarray(xyz, float), membrane.rest, membrane.forces.triangles, membrane.forces.rest_residual, self._origin, rows=rows,
            columns=columns, rest_pressure=self._material.rest_pressure, settled=_FILL_LOAD))
