# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What is known of one finger: how places on its detector map to the sphere, and what the light tells."""
from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .geometry import bent
from .maps import CellTable, SmoothMap
from .offset_map import NOMINAL_BETA, PaperMap
from .response import level_basis, load, place_part

NORMAL, DEVIATION, INSIDE, LEVEL, CROSS, LOADS = slice(0, 3), 3, 4, 5, 6, slice(7, 9)
_CROSS_TERMS = 6
_UNTOLD = np.pi / 18  # rad: what the nominal map may be wrong by


@dataclass(frozen=True)
class FingerModel:
    """The numbers of one finger; those that were not calibrated are None.

    paper: the paper's map; smooth: what takes its place, rad on the flattened sphere; deviation: rad, of the paper's map where there is
    no smooth one; reach: half widths, how far from a calibrated contact places are known; level: coefficients of the light at touch, V;
    level_limits: its range, V, and the largest distance from the detector's centre, half widths, at which it was seen; cross: of the
    fourth combination of the outputs over the total, for a single contact, and cross_sigma what it scatters by; force, depth: of log N
    and log m; shot: V.
    """

    paper: PaperMap = field(default_factory=lambda: PaperMap(np.zeros(2), NOMINAL_BETA))
    smooth: SmoothMap | None = None
    deviation: float = _UNTOLD
    reach: float = 0.25
    level: np.ndarray | None = None
    level_limits: tuple[float, float, float] = (0.0, np.inf, np.inf)
    cross: np.ndarray | None = None
    cross_sigma: float = 0.0
    force: np.ndarray | None = None
    depth: np.ndarray | None = None
    shot: float = 0.0

    def normals(self, place: np.ndarray) -> np.ndarray:
        """Unit normals (N, 3) at places (N, 2), half widths."""
        return self.paper.normals(place) if self.smooth is None else bent(self.smooth.values(place))

    def levels(self, place: np.ndarray) -> np.ndarray:
        """Light at touch (N,), V, not beyond what was seen; NaN where not calibrated."""
        if self.level is None:
            return np.full(len(place), np.nan)
        low, high, reach = self.level_limits
        inner = place * np.minimum(1.0, reach / np.maximum(np.hypot(*place.T), 1e-9))[:, None]
        return np.clip(level_basis(inner, len(self.level)) @ self.level, low, high)

    @cached_property
    def table(self) -> CellTable:
        """All of it by place, for the fast path: the channels named above. Made once: it takes half a second and 50 MB meanwhile."""
        return CellTable(self._channels)

    def _channels(self, place: np.ndarray) -> np.ndarray:
        nothing = np.full(len(place), np.nan)
        if self.smooth is None:
            deviation, inside = np.full(len(place), self.deviation), np.ones(len(place))
        else:
            deviation = self.smooth.deviation(place)
            inside = self._inside(place)
        cross = nothing if self.cross is None else cross_basis(place) @ self.cross
        parts = [nothing if fitted is None else place_part(fitted, place) for fitted in (self.force, self.depth)]
        return np.column_stack([self.normals(place), deviation, inside, self.levels(place), cross, *parts])

    def _inside(self, place: np.ndarray) -> np.ndarray:
        """1 where a calibrated contact is within reach, else 0."""
        nearest = np.full(len(place), np.inf)
        for known in self.smooth.place:
            nearest = np.minimum(nearest, ((place - known) ** 2).sum(1))
        return (nearest <= self.reach**2).astype(float)

    def loads(self, at_place: np.ndarray, place: np.ndarray, light: float) -> tuple[float, float]:
        """Force, N, and depth, m, from light, V, at a place (2,), where the table has at_place (2,) for both; NaN where not calibrated."""
        square = float(place @ place)
        return tuple(math.nan if fitted is None else load(fitted, part, square, light)
                     for fitted, part in zip((self.force, self.depth), at_place.tolist()))


def cross_basis(place: np.ndarray) -> np.ndarray:
    """Basis (N, 6) of the fourth combination of the outputs at places (N, 2)."""
    x, y = place.T
    return np.column_stack([np.ones(len(place)), x, y, x * y, x * x, y * y])[:, :_CROSS_TERMS]
