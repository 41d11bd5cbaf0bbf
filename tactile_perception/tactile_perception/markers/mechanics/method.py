# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Touches of a sheet by its mechanics: the presses that explain the whole field of markers (one straight down, one that is dragged, or
several at once), and their uncertainty."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from .calibration import QUICK, SheetCalibration, calibrate_sheet
from .matched_filter import SheetStart
from .projection import Press, read_press
from .reduced_model import SheetLibrary
from .solver import Inverse, Seen, SheetInverse, hindrance
from ..touches.presses import Presses
from ..touches.touch import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, TouchEstimate
from ..view.marker_field import MarkerField
from ..view.sensor import MarkerSensor

WRONG = 2.5         # misfit, from which on something else is looked for
BETTER = 0.5        # of the misfit, below which a drag has that of a press straight down
FAR_BETTER = 0.5    # the same of two presses
HOPELESS = 4.0      # times that, above which it is not sought any further
RIGHT = 4.0         # misfit, above which two presses are not believed
APART = 2.2         # marker pitches between two tips, below which they are one
SLIGHT = 0.12       # of the deeper press's depth: a slighter one beside it is not believed
AGAIN = 2           # times that two presses are solved for anew, from where they were
ALIKE = 0.3         # of the displacements: what has changed by less since the last frame may be what that frame showed
SEARCHED = 15       # frames after which two presses that explain too little are sought anew
UNSURE_PLACE, UNSURE_DEPTH = 0.4, 0.15  # of what other tips move a place, and sink the sheet, by which that may be wrong


@dataclass(frozen=True)
class Tip:
    """vector: (3,) m, place and depth of a tip, and its covariance; log_radius: of its radius over the calibrated one."""

    vector: np.ndarray
    covariance: np.ndarray
    log_radius: float


@dataclass
class _Followed:
    """The last frame's shift (K, 2) m; the last press straight down, drag, and two presses, that were looked at where one press does not
    explain enough; whether two were told; how many frames ago they were sought."""

    shift: np.ndarray
    straight: Inverse | None = None
    dragged: Inverse | None = None
    two: Inverse | None = None
    told_two: bool = False
    age: int = 0

    def leads_to(self, field: MarkerField) -> bool:
        """Whether a field is nearly that of the last frame."""
        known = np.isfinite(self.shift) & np.isfinite(field.shift) if self.shift.shape == field.shift.shape else np.zeros(0, bool)
        if not known.any():
            return False
        now = field.shift[known]
        change = now - self.shift[known]
        return bool(change @ change < ALIKE**2 * (now @ now))


class SheetPresses:
    """Explains fields by presses, frame after frame. pitch: m, of the markers."""

    def __init__(self, library: SheetLibrary, inverse: SheetInverse, start: SheetStart, pitch: float):
        self._library, self._inverse, self._start, self._pitch = library, inverse, start, pitch
        self.forget()

    def forget(self) -> None:
        """Nothing touches: what comes next is sought anew."""
        self._last = _Followed(np.zeros((0, 2)))

    def explain(self, field: MarkerField, begin: Press) -> Inverse:
        """What explains a field; begin: where a press of it may be."""
        last = self._last = replace(self._last, shift=field.shift) if self._last.leads_to(field) else _Followed(field.shift)
        last.age += 1
        seen = Seen(field)
        straight = self._inverse.solve(seen, [begin]) if last.straight is None else self._continued(seen, last.straight)
        if straight.misfit < WRONG and not last.told_two:
            last.straight = None
            return straight
        last.straight, last.dragged = straight, self._dragged(seen, straight, last.dragged)
        single = last.dragged if last.dragged.misfit < BETTER * straight.misfit else straight
        if single.misfit < WRONG and not last.told_two:
            return single
        enough = FAR_BETTER * last.dragged.misfit
        last.two = self._followed(seen, last.two, enough) or self._two(field, seen, straight, enough)
        last.told_two = self._are_two(last.two, enough)
        return last.two if last.told_two else single

    def _continued(self, seen: Seen, last: Inverse, dragged: bool = False) -> Inverse:
        """Presses from where the last were."""
        return self._inverse.solve(seen, last.presses, last.mixed, dragged, near=True)

    def _dragged(self, seen: Seen, straight: Inverse, last: Inverse | None) -> Inverse:
        """One press that has dragged the sheet along, from where the last was, or from one straight down."""
        if last is not None:
            return self._continued(seen, last, dragged=True)
        return self._inverse.solve(seen, self._inverse.solve(seen, straight.presses, dragged=True).presses, dragged=True)

    def _followed(self, seen: Seen, last: Inverse | None, enough: float) -> Inverse | None:
        """Two presses from where the last were; None where they have to be sought anew."""
        if last is None:
            return None
        two = self._continued(seen, last)
        return two if self._last.age < SEARCHED or two.misfit < WRONG and self._are_two(two, enough) else None

    def _two(self, field: MarkerField, seen: Seen, one: Inverse, enough: float) -> Inverse:
        """Two presses: one, and another where it leaves most unexplained; given up where their misfit stays far from enough."""
        self._last.age = 0
        told = np.zeros((len(field), 3))
        told[seen.index] = self._inverse.predict(one.presses, seen)[0]
        left = replace(field, shift=field.shift - told[:, :2], growth=field.growth - told[:, 2])
        two = self._inverse.solve(seen, [*one.presses, self._start.best(left)[0]])
        for _ in range(AGAIN if two.misfit < HOPELESS * enough else 0):
            two = self._inverse.solve(seen, two.presses, two.mixed)
        return two

    def _are_two(self, two: Inverse, enough: float) -> bool:
        """Whether two presses explain enough, and are no one that is taken for two."""
        if two.misfit > min(RIGHT, enough):
            return False
        (one, other), depths = tips_of(self._library, two), sorted(press.depth for press in two.presses)
        apart = np.hypot(*(one.vector - other.vector)[:2])
        return bool(apart > APART * self._pitch and depths[0] > SLIGHT * depths[1])


def tips_of(library: SheetLibrary, found: Inverse) -> list[Tip]:
    """Where the tips of presses stand. One that comes down where others have inclined the sheet touches it uphill of its lowest point."""
    tips = []
    for k, press in enumerate(found.presses):
        vector, covariance = found.tip(k)
        if len(found.presses) > 1:
            alone = [read_press(library, other, press.place[None]) for other in found.presses]
            others = (sum(alone) - alone[k] + found.mixed * hindrance(alone))[0]
            radius, slope, sunk = library.plan.radius * np.exp(press.log_radius), others[1:, 2], -others[0, 2]
            vector = vector + np.append(-radius * slope, sunk + 0.5 * radius * slope @ slope)
            unsure = np.array([UNSURE_PLACE * radius * np.hypot(*slope)] * 2 + [UNSURE_DEPTH * sunk])
            covariance = covariance + np.diag(unsure**2)
        tips.append(Tip(vector, covariance, press.log_radius))
    return tips


FEWEST = 10    # markers seen, below which nothing is told
STANDS_OUT = 8.0  # sigmas by which a field must stand out of the noise
SURE = 4.0     # sigmas by which the depth must
BEYOND = 1.02  # of the calibrated depth, from where on it is out of range
UNEXPLAINED = 8.0  # misfit, above which there may be several touches
EDGE = 0.999   # of the reach of the library


class SheetModelMethod:
    """The 'model' method for sheets: see membrane_fem, reduced_model, mechanics.solver."""

    def __init__(self, calibration: SheetCalibration, sensor: MarkerSensor):
        self._calibration = calibration
        library, noise = calibration.library, calibration.noise
        inverse = SheetInverse(library, noise, calibration.marker_radius, max(sensor.pitch))
        self._start = SheetStart(library, noise.shift, noise.growth)
        self._presses = SheetPresses(library, inverse, self._start, max(sensor.pitch))
        self._margin = np.array(sensor.pitch)

    @classmethod
    def fit(cls, presses: Presses, sensor: MarkerSensor) -> dict:
        """Numbers for the calibration file. Raises BadCalibration where the presses cannot determine the model."""
        return calibrate_sheet(presses, sensor).numbers()

    @classmethod
    def fit_quickly(cls, presses: Presses, sensor: MarkerSensor, fitted: Mapping) -> dict:
        """As fit, on a coarser mesh and from the numbers fitted to more presses of the same sheet: in a fraction of the time, with
        somewhat larger errors."""
        return calibrate_sheet(presses, sensor, QUICK, SheetCalibration.from_numbers(fitted).found).numbers()

    @classmethod
    def from_fitted(cls, fitted: Mapping, sensor: MarkerSensor) -> SheetModelMethod:
        """The method with its numbers from a calibration file. Raises BadCalibration where they are of another kind."""
        return cls(SheetCalibration.from_numbers(fitted), sensor)

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touches of one frame; empty where nothing touches. Fits begin where those of the last frame ended, if that was alike."""
        if field.seen.sum() < FEWEST:
            return []
        field = self._calibration.eyes.shifted(field)
        start, score = self._start.best(field)
        if score < STANDS_OUT:
            self._presses.forget()
            return []
        found = self._presses.explain(field, start)
        touches = [self._touch(tip, found.misfit) for tip in tips_of(self._calibration.library, found)]
        return [touch for touch in touches if touch.depth > SURE * touch.depth_sigma]

    def _touch(self, found: Tip, misfit: float) -> TouchEstimate:
        calibration, tip = self._calibration, found.vector
        extra = np.array([calibration.place_error, calibration.place_error, calibration.depth_share * tip[2]])
        turned = np.diag([1.0, 1.0, -1.0])  # deeper is lower
        covariance = turned @ (found.covariance + np.diag(extra**2)) @ turned
        radius = float(calibration.library.plan.radius * np.exp(found.log_radius))
        position = np.append(tip[:2] - calibration.offset, -tip[2])
        flags = self._flags(tip) | AMBIGUOUS * (misfit > UNEXPLAINED)
        return TouchEstimate(position, float(tip[2]), covariance, float(np.sqrt(covariance[2, 2])), radius, flags)

    def _flags(self, tip: np.ndarray) -> int:
        low, high = self._calibration.place_range
        outside = (tip[:2] < low - self._margin).any() or (tip[:2] > high + self._margin).any()
        flags = OUT_OF_RANGE if outside or tip[2] > BEYOND * self._calibration.deepest else 0
        return flags | (AT_EDGE if (np.abs(tip[:2]) >= EDGE * self._calibration.library.plan.reach).any() else 0)
