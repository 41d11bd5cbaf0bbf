# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Inversion of the sheet model: Gauss-Newton for the presses that explain a marker field, with robust weights and priors.

The field of two presses is the sum of the fields of each alone, less an interaction term: the sheet between them is tauter. The error
of this approximation is noise of the markers that both presses displace.
"""
from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np

from ... import _core
from .projection import Press
from .reduced_model import SheetLibrary
from ..field import MarkerField

SIZE = 6    # of a press's vector
ANY_TIP = 0.0, 0.15  # log of a tip's radius over the calibrated one: prior mean and standard deviation. Chosen
SURE = 4.0  # least depth of a touch, standard deviations of the fit. Chosen
NEAR = 2.5  # marker pitches from a press within which markers are discs; farther away points. Chosen


@dataclass(frozen=True)
class FieldNoise:
    """Standard deviations: shift, m, and growth of an untouched field; share_shift and share_growth (1/m): model error over a marker's
    displacement, m; depth_shift and depth_growth (1/m): over the depth of the press, m.
    """

    shift: float
    growth: float
    share_shift: float
    share_growth: float
    depth_shift: float = 0.0
    depth_growth: float = 0.0


@dataclass(frozen=True)
class Inverse:
    """presses: T; covariance: (6 T, 6 T) of their vectors, with one more row for the interaction factor of two; misfit: mean squared
    normalised residual (about 1); wrenches: (T, 9) log of normal force over depth, tangential over normal force, moment about the tip over
    normal force, m, and centre of the pressure relative to the tip, m; mixed: the interaction factor, 0 for one."""

    presses: list[Press]
    covariance: np.ndarray
    misfit: float
    wrenches: np.ndarray
    mixed: float = 0.0

    def is_sure(self, k: int) -> bool:
        """Whether the markers show press k: that its depth is uncertain, as in drags, does not make it less so."""
        (*_, depth), covariance = self.tip(k)
        return bool(depth > SURE * np.sqrt(covariance[2, 2]))

    def tip(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Place and depth (3,), m, of press k as if it were alone, and their covariance (3, 3), scaled by a misfit above 1."""
        part = slice(SIZE * k, SIZE * k + 3)
        return self.presses[k].vector[:3], self.covariance[part, part] * max(self.misfit, 1.0)


class Seen:
    """The N markers of a field that are seen: rest (N, 2), eye (N, 3), value (N, 3) shift and growth, NaN where unknown; sigma (N,).

    motion: (N, 3) of value, of those that a second camera sees at a moment of its own, by an unknown share of which they may be late.
    """

    def __init__(self, field: MarkerField, motion: np.ndarray | None = None):
        self.index = np.flatnonzero(field.seen & np.isfinite(field.eye).all(1))
        self.rest, self.eye, self.sigma = field.rest[self.index], field.eye[self.index], field.sigma[self.index]
        self.value = np.column_stack([field.shift[self.index], field.growth[self.index]])
        self.motion = np.zeros((len(self.index), 3)) if motion is None else motion[self.index]


class SheetInverse:
    """Fits presses to marker fields. marker_radius: m; pitch: m, of the markers."""

    def __init__(self, library: SheetLibrary, noise: FieldNoise, marker_radius: float, pitch: float):
        self._library, self._marker = library, {'marker_radius': marker_radius, 'near': NEAR * pitch}
        self._noise = astuple(noise)

    def solve(self, seen: Seen, start: list[Press], drags: bool = False, tip: tuple[float, float] = ANY_TIP) -> Inverse:
        """Fit one press or two from start; drags: whether their drags are unknown, else 0; tip: prior mean and standard deviation of the
        log radius."""
        state, covariance, misfit, wrenches = _core.fit_presses(
            self._library.table, seen.rest, seen.eye, seen.value, seen.sigma, seen.motion, np.array([press.vector for press in start]),
            noise=self._noise, tip=tip, drags=drags, **self._marker)
        presses = [Press.of(state[SIZE * k:SIZE * (k + 1)]) for k in range(len(start))]
        return Inverse(presses, covariance, misfit, wrenches, float(state[SIZE * len(start):].sum()))

    def predict(self, presses: list[Press], seen: Seen, mixed: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Predicted shift and growth (N, 3), and the displacement with its derivatives by x and y (N, 3, 3)."""
        return show(self._library, presses, seen.rest, seen.eye, mixed, **self._marker)


def show(library: SheetLibrary, presses: list[Press], rest: np.ndarray, eye: np.ndarray, mixed: float = 0.0, marker_radius: float = 0.0,
         near: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Shift, m, and growth (N, 3) of markers at rest (N, 2), m, seen from eye (N, 3), m, under one press or two with an interaction factor
    mixed; and the displacement of the sheet there with its derivatives by x and y (N, 3, 3). Markers of marker_radius, m, nearer than near,
    m, to a press are discs, else points."""
    return _core.show_presses(library.table, rest, eye, np.array([press.vector for press in presses]), mixed=mixed,
                              marker_radius=marker_radius, near=near)
