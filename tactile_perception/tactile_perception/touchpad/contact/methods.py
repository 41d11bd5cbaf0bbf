# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Classification of dots as free, sticking or slipping: the methods by name, behind one interface."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..._core import lie_on_a_line
from ...common.surface import label_score, to_grid
from ...errors import BadFrame
from .contact_score import contact_score
from .loads import LoadEstimator
from ..membrane.forces import MembraneMaterial
from .published import PaperRegion
from .stick_slip import StickSlipTracker

_THINNEST = 1e-3  # width over length of the dots' places, below which they lie on a line; chosen


class AllDots(NamedTuple):
    """All K dots of the grid, unseen ones interpolated. xyz: (K, 3) m; score, state: (K,); force: (K, 3) N on the sensor, which sum up to
    the wrench's force."""

    xyz: np.ndarray
    score: np.ndarray
    state: np.ndarray
    force: np.ndarray


@dataclass(frozen=True)
class DotClassification:
    """Classification of the N seen dots of one frame.

    state: (N,) uint8, 0 none, 1 sticking, 2 slipping; score: (N,), above 0.5 in contact; force: (N, 3) N on the sensor, None if the
    method estimates no forces; wrench: (6,) N and N m at the sensor's origin, NaN if unknown; all_dots: None if the method does not
    interpolate unseen dots; slides: (N, 2) m, way over each dot since the last frame of an object in gross slip, as it moved when it last
    held dots, NaN: unknown, None if the method does not follow objects.
    """

    state: np.ndarray
    score: np.ndarray
    force: np.ndarray | None
    wrench: np.ndarray
    all_dots: AllDots | None = None
    slides: np.ndarray | None = None


class MembraneMethod:
    """By the membrane's force balance; origin: (3,) m, camera centre."""

    def __init__(self, rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray):
        self._shape = rows, columns
        self._estimator = LoadEstimator(rows, columns, material, origin)
        self._states = StickSlipTracker(rows, columns, origin)

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Set the dots' rest positions (K, 3), m."""
        self._estimator.set_rest(rest_xyz)

    def classify(self, ids: np.ndarray, xyz: np.ndarray, stamp_s: float) -> DotClassification:
        """Classify dots ids (N,) at xyz (N, 3), m. Raises BadFrame for dots on a line, which span no membrane."""
        if len(ids) > 2 and lie_on_a_line(np.asarray(xyz, float), thinnest=_THINNEST):
            raise BadFrame('the 3D positions of all dots lie on a line; check the camera, or take a new reference')
        loads = self._estimator.loads(ids, xyz)
        if loads.none:
            return self._untouched(loads.xyz, loads.seen, ids)
        score = contact_score(self._estimator.membrane, loads)
        state = self._states.update(loads, score)
        force, wrench = loads.carried(*self._shape) if (score > 0.5).any() else (np.zeros_like(loads.force), np.zeros(6))
        every = AllDots(loads.xyz, score, state, force)
        return DotClassification(state[ids], score[ids], loads.force[ids], wrench, every, self._states.slides()[ids])

    def _untouched(self, xyz: np.ndarray, seen: np.ndarray, ids: np.ndarray) -> DotClassification:
        """Result of a frame without loads; xyz: (K, 3) m; seen: (K,) bool."""
        self._states.observe_free(xyz, seen)
        every = AllDots(xyz, np.zeros(len(xyz)), np.zeros(len(xyz), np.uint8), np.zeros(xyz.shape))
        return DotClassification(every.state[ids], every.score[ids], every.force[ids], np.zeros(6), every)


class PaperMethod:
    """By the movements of dots (paper touchpad_contact_region, eqs 2, 7, 9 to 14); estimates no forces."""

    def __init__(self, rows: int, columns: int, d_max: float, delta_d: float):
        self._shape = rows, columns
        self._region = PaperRegion(rows, columns, d_max, delta_d)
        self._rest = np.full((rows * columns, 3), np.nan)

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Set the dots' rest positions (K, 3), m."""
        self._rest = rest_xyz

    def classify(self, ids: np.ndarray, xyz: np.ndarray, stamp_s: float) -> DotClassification:
        """Classify dots ids (N,) at xyz (N, 3), m, at stamp_s."""
        state = self._region.process(ids, xyz, self._rest[ids], stamp_s).state
        score = label_score(to_grid(ids, (state > 0).astype(float), *self._shape)).ravel()[ids]
        return DotClassification(state, score, None, np.full(6, np.nan))


CONTACT_METHODS = {
    'membrane': lambda rows, columns, material, origin, values: MembraneMethod(rows, columns, material, origin),
    'paper': lambda rows, columns, material, origin, values: PaperMethod(rows, columns, values['paper.d_max'], values['paper.delta_d']),
}


def make_method(rows: int, columns: int, material: MembraneMaterial, origin: np.ndarray, values: Mapping) -> MembraneMethod | PaperMethod:
    """The method that values (of REGION_PARAMETERS) select; origin: (3,) m, camera centre."""
    return CONTACT_METHODS[values['contact']](rows, columns, material, origin, values)
