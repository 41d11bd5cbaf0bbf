# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which dots touch, stick and slip: the methods by name, behind one call."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...common.contour import label_score
from ...common.dot_grid import to_grid
from .contact_score import around, contact_score
from .loads import DotLoads, LoadEstimator
from ..membrane.forces import MembraneMaterial
from .published import PaperRegion
from .stick_slip import StickSlipTracker

class AllDots(NamedTuple):
    """All K dots of the grid, those not seen as the membrane has them. xyz: (K, 3) m; score, state: (K,); force: (K, 3) N on the sensor,
    whose sum is the wrench's."""

    xyz: np.ndarray
    score: np.ndarray
    state: np.ndarray
    force: np.ndarray


@dataclass(frozen=True)
class DotClassification:
    """What a method says of the seen dots of one frame.

    state: (N,) uint8, 0 none, 1 sticking, 2 slipping; score: (N,), above 0.5 in contact; force: (N, 3) N on the sensor, None where the
    method knows no forces; wrench: (6,) N and N m at the sensor's origin, NaN where not known; whole: None where the method knows only
    the dots that are seen.
    """

    state: np.ndarray
    score: np.ndarray
    force: np.ndarray | None
    wrench: np.ndarray
    whole: AllDots | None = None


class MembraneMethod:
    """The membrane's own force balance, seen by a camera with its centre at origin (3,), m."""

    def __init__(self, rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray):
        self._shape = rows, columns
        self._balance = LoadEstimator(rows, columns, material, origin)
        self._states = StickSlipTracker(rows, columns, origin)

    def renew(self, rest_xyz: np.ndarray) -> None:
        """Take the dots' rest places (K, 3), m."""
        self._balance.renew(rest_xyz)

    def judge(self, ids: np.ndarray, xyz: np.ndarray, stamp_s: float) -> DotClassification:
        """The states of dots ids (N,) at xyz (N, 3), m."""
        moved, seen = self._balance.displacements(ids, xyz)
        if self._balance.unloaded(moved):
            return self._untouched(self._balance.membrane.rest + moved, seen, ids)
        loads = self._balance.loads(moved, seen)
        score = contact_score(self._balance.membrane, loads)
        state = self._states.update(loads, score)
        carries = self._carrying(loads, score)
        return DotClassification(state[ids], score[ids], loads.force[ids], loads.wrench(carries),
                         AllDots(loads.xyz, score, state, loads.force * carries[:, None]))

    def _untouched(self, xyz: np.ndarray, seen: np.ndarray, ids: np.ndarray) -> DotClassification:
        """Of a frame in which no dot at xyz (K, 3), m, carries a load."""
        self._states.rest(xyz, seen)
        whole = AllDots(xyz, np.zeros(len(xyz)), np.zeros(len(xyz), np.uint8), np.zeros(xyz.shape))
        return DotClassification(whole.state[ids], whole.score[ids], whole.force[ids], np.zeros(6), whole)

    def _carrying(self, loads: DotLoads, score: np.ndarray) -> np.ndarray:
        """(K,) 1 for the dots that carry a load and those beside them, on which a border's load spreads; 0 where nothing touches."""
        if not (score > 0.5).any():
            return np.zeros(len(score))
        loaded = (loads.load > 0.5).astype(float).reshape(self._shape)
        return np.minimum(around(loaded) + loaded, 1).ravel()


class PaperMethod:
    """The paper's tests on the movements of dots (paper touchpad_contact_region, eqs 2, 7, 9 to 14); knows no forces."""

    def __init__(self, rows: int, columns: int, d_max: float, delta_d: float):
        self._shape = rows, columns
        self._region = PaperRegion(rows, columns, d_max, delta_d)
        self._rest = np.full((rows * columns, 3), np.nan)

    def renew(self, rest_xyz: np.ndarray) -> None:
        """Take the dots' rest places (K, 3), m."""
        self._rest = rest_xyz

    def judge(self, ids: np.ndarray, xyz: np.ndarray, stamp_s: float) -> DotClassification:
        """The states of dots ids (N,) at xyz (N, 3), m."""
        state = self._region.process(ids, xyz, self._rest[ids], stamp_s).state
        score = label_score(to_grid(ids, (state > 0).astype(float), *self._shape)).ravel()[ids]
        return DotClassification(state, score, None, np.full(6, np.nan))


CONTACT_METHODS = {
    'membrane': lambda rows, columns, material, origin, values: MembraneMethod(rows, columns, material, origin),
    'paper': lambda rows, columns, material, origin, values: PaperMethod(rows, columns, values['paper.d_max'], values['paper.delta_d']),
}


def make_method(rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray, values: Mapping) -> MembraneMethod | PaperMethod:
    """The method that values (of REGION_PARAMETERS) name, for a camera with its centre at origin (3,), m."""
    return CONTACT_METHODS[values['contact']](rows, columns, material, origin, values)
