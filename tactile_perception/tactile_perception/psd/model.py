# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The calibrated model of one finger: map from detector to sphere, light at first contact, force and depth from light."""
from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .creep import Creep
from .geometry import exp_map
from .light_shift import LightShift
from .maps import SmoothMap, tabulated
from .equidistant_map import NOMINAL_BETA, EquidistantMap
from .response import LOAD_TERMS, level_basis, place_part

# Channels of the table, as in src/psd/place_table.hpp
NORMAL, DEVIATION, INSIDE, LEVEL, CROSS, LOADS, LIGHT, BEND = slice(0, 3), 3, 4, 5, 6, slice(7, 9), 9, slice(10, 13)
_NOMINAL_DEVIATION = np.pi / 18  # rad, of the uncalibrated map. Chosen: 10 degrees, above the largest error of the paper (6 degrees, fig 8)


@dataclass(frozen=True)
class FingerModel:
    """Parameters of one finger; those that were not calibrated are None.

    paper: the equidistant map of the paper; smooth: the map that replaces it, to tangent vectors at the pole, rad; shift: what a contact's
    light adds to it; deviation: rad, standard deviation of the paper's map; reach: half widths, distance from a calibrated contact within
    which positions are in range; level: coefficients of the light at first contact, V; level_limits: its smallest and largest value, V, and
    the largest calibrated distance from the detector's centre, half widths; cross: coefficients of the cross term over the total for a
    single contact; cross_volts: V, standard deviation; force, depth: coefficients of log N and log m (response.features); shot: V, variance
    of an output per V of its signal; room: (4,) V, untouched outputs at the calibration; creep: of the cover.
    """

    paper: EquidistantMap = field(default_factory=lambda: EquidistantMap(np.zeros(2), NOMINAL_BETA))
    smooth: SmoothMap | None = None
    shift: LightShift | None = None
    deviation: float = _NOMINAL_DEVIATION
    reach: float = 0.25
    level: np.ndarray | None = None
    level_limits: tuple[float, float, float] = (0.0, np.inf, np.inf)
    cross: np.ndarray | None = None
    cross_volts: float = 0.0
    force: np.ndarray | None = None
    depth: np.ndarray | None = None
    shot: float = 0.0
    room: np.ndarray | None = None
    creep: Creep | None = None

    def normals(self, place: np.ndarray, light: np.ndarray | None = None) -> np.ndarray:
        """Unit normals (N, 3) at detector positions (N, 2), half widths, of contacts with light (N,), V, None for the typical one."""
        if self.smooth is None:
            return self.paper.normals(place)
        values = self.smooth.values(place)
        if self.shift is not None and light is not None:
            values = values + self.shift.values(place, light)
        return exp_map(values)

    def levels(self, place: np.ndarray) -> np.ndarray:
        """Light at first contact (N,), V, clipped to the calibrated range; NaN without calibration."""
        if self.level is None:
            return np.full(len(place), np.nan)
        low, high, reach = self.level_limits
        inner = place * np.minimum(1.0, reach / np.maximum(np.hypot(*place.T), 1e-9))[:, None]
        return np.clip(level_basis(inner, len(self.level)) @ self.level, low, high)

    @cached_property
    def table(self) -> np.ndarray:
        """Table (nodes, nodes, channels) of the model by detector position; its channels are the slices above. Made on first use."""
        return tabulated(self._channels)

    def _channels(self, place: np.ndarray) -> np.ndarray:
        nothing = np.full(len(place), np.nan)
        if self.smooth is None:
            deviation, inside = np.full(len(place), self.deviation), np.ones(len(place))
        else:
            deviation = self.smooth.deviation(place)
            inside = self._inside(place)
        cross = nothing if self.cross is None else cross_basis(place) @ self.cross
        parts = [nothing if fitted is None else place_part(fitted, place) for fitted in (self.force, self.depth)]
        return np.column_stack([self.normals(place), deviation, inside, self.levels(place), cross, *parts, *self._bend(place)])

    def _bend(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Light (N,), V, of typical contacts, and what the normals (N, 3) change by with twice that light, from half to one and a half."""
        if self.shift is None:
            return np.ones(len(place)), np.zeros((len(place), 3))
        light = self.shift.light(place)
        return light, self.normals(place, 1.5 * light) - self.normals(place, 0.5 * light)

    def _inside(self, place: np.ndarray) -> np.ndarray:
        """(N,) 1 where a calibrated contact is within reach, else 0."""
        nearest = np.full(len(place), np.inf)
        for known in self.smooth.place:
            nearest = np.minimum(nearest, ((place - known) ** 2).sum(1))
        return (nearest <= self.reach**2).astype(float)

    @cached_property
    def load_terms(self) -> np.ndarray:
        """(2, 8) coefficients of force and depth; NaN where not calibrated."""
        return np.stack([np.full(LOAD_TERMS, np.nan) if fitted is None else fitted for fitted in (self.force, self.depth)])


def cross_basis(place: np.ndarray) -> np.ndarray:
    """Basis (N, 6) of the cross term at detector positions (N, 2)."""
    x, y = place.T
    return np.column_stack([np.ones(len(place)), x, y, x * y, x * x, y * y])
