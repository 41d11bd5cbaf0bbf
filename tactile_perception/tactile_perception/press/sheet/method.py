# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Touches of a sheet by model inversion: the presses (one straight, one dragged, or two at once) that best explain the marker field."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from .calibration import SheetCalibration, calibrate_sheet
from .fit import SURE, Inverse, Seen, SheetInverse, SheetStart, show
from .library import Press, SheetLibrary
from ...common.geometry import cross
from ..choice import DRAGGED, Choice, Evidence
from ..presses import Presses
from ..estimate import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, TouchEstimate
from ..field import MarkerField
from ..sensor import MarkerSensor

# All chosen.
ORDINARY = 0.5      # residual chi-square of presses under their own hypothesis: 0.2 to 1 on simulated sheets
FLOOR_PLACE = 0.007  # least standard deviation of a place over the tip radius: on other paths than calibration's friction differs
DRAG_PLACE, DRAG_DEPTH = 0.1, 0.06  # standard deviations of place and depth over the tip radius, of a drag of 1
RADIUS, DRAG_RADIUS = 0.1, 0.2  # standard deviations of a log radius, of a press and of a drag: other friction passes for another radius
AMISS_PLACE, AMISS_DEPTH = 0.1, 0.04  # standard deviations over the tip radius, of two presses at a misfit of 2


@dataclass(frozen=True)
class Tip:
    """place: (3,) m, of the tip, or of two the centre of its contact, z up; depth: m; covariance: (3, 3) m^2, of x, y and depth;
    log_radius: of its radius over the calibrated one."""

    place: np.ndarray
    depth: float
    covariance: np.ndarray
    log_radius: float


def tips_of(library: SheetLibrary, found: Inverse) -> list[Tip]:
    """Tips of presses. Of two presses each is reported at the centre of its contact: one inclines the sheet under the other, whose lowest
    point then lies downhill of what touches the sheet."""
    tips = []
    for k, press in enumerate(found.presses):
        (x, y, depth), covariance = found.tip(k)
        covariance = covariance + np.diag(np.square([*[max(FLOOR_PLACE, DRAG_PLACE * np.hypot(*press.drag))] * 2,
                                                     DRAG_DEPTH * np.hypot(*press.drag)]) * library.plan.radius**2)
        place = np.array([x, y, -depth])
        if len(found.presses) == 1:  # what x, y and depth change where the radius is another by what the model lacks
            sigma = DRAG_RADIUS if any(press.drag) else RADIUS
            shift = sigma * found.covariance[:3, 3] / found.covariance[3, 3]
            covariance = covariance + np.outer(shift, shift)
        else:
            camera_centre = np.array([[*press.place, -1.0]])
            whole, alone = (show(library, presses, press.place[None], camera_centre, found.mixed)[1][0]
                            for presses in (found.presses, [press]))
            slope, aside, sunk = (whole - alone)[1:, 2], (whole - alone)[0, :2], -(whole - alone)[0, 2]
            centre, radius = found.wrenches[k, 6:], library.plan.radius * np.exp(press.log_radius)
            above = radius - centre[2]
            depth += sunk + 0.5 * radius * slope @ slope
            height = centre[2] - depth + slope @ (0.5 * above * slope + centre[:2])
            place = np.append(press.place + aside + centre[:2] - centre[2] * slope, height)
            amiss = np.array([AMISS_PLACE] * 2 + [AMISS_DEPTH]) * library.plan.radius
            covariance = covariance + np.diag(amiss**2 * max(found.misfit - 1.0, 0.0))
        tips.append(Tip(place, depth, covariance, press.log_radius))
    return tips


# All chosen.
FEWEST = 10    # markers needed
STANDS_OUT = 8.0  # detection threshold of the matched filter, standard deviations
BEYOND = 1.02  # times the calibrated depth: deeper is out of range
STRANGE = 2.5  # misfit above which the first frame that shows a touch is not believed
UNEXPLAINED = 4.0  # misfit above which an estimate is ambiguous
UNSEEN = 2.0   # marker pitches from all markers that are seen: a touch there is not reported
EDGE = 0.999   # of the library's reach, from which a touch is at the edge


class SheetModelMethod:
    """The 'model' method for sheets: inversion of membrane mechanics (mechanics.py, library.py, fit.py)."""

    def __init__(self, calibration: SheetCalibration, sensor: MarkerSensor):
        self._calibration = calibration
        library, noise = calibration.library, calibration.noise
        inverse = SheetInverse(library, noise, calibration.marker_radius, max(sensor.pitch))
        self._start = SheetStart(library, noise.shift, noise.growth)
        self._inverse, self._choice = inverse, Choice()
        self._margin = np.array(sensor.pitch)
        self._before: np.ndarray | None = None
        self._lasts = False

    @classmethod
    def fit(cls, presses: Presses, sensor: MarkerSensor, fitted: Mapping | None = None) -> dict:
        """Parameters for the calibration file; fitted: those of more presses of the same sheet, whose simulated library is kept, as a few
        numbers determine it. Raises BadCalibration where the presses do not determine the model."""
        known = SheetCalibration.from_numbers(fitted) if fitted else None
        return calibrate_sheet(presses, sensor, known).numbers()

    @classmethod
    def from_fitted(cls, fitted: Mapping, sensor: MarkerSensor) -> SheetModelMethod:
        """The method with its parameters from a calibration file. Raises BadCalibration where they are invalid."""
        return cls(SheetCalibration.from_numbers(fitted), sensor)

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touches of one frame; empty without contact, and with two cameras in the first frame of a touch that no press explains: they
        may show it at different moments. Of the frames before, only the drag counts, and the motion of a
        second camera's markers, which may be seen at another moment."""
        motion = self._motion(field)
        begins, self._lasts = not self._lasts, False
        if field.seen.sum() < FEWEST:
            self._choice = Choice()
            return []
        field = self._calibration.camera_centres.shifted(field)
        best, score = self._start.best(field)
        start = [best]
        if score < STANDS_OUT:
            start = self._choice.dragged  # it goes on where the field is like no straight press
        if start is None:
            return []
        self._lasts = True
        found = self._explained(field, start, motion)
        if begins and motion is not None and found.misfit > STRANGE:
            return []
        touches = [self._touch(tip, found.misfit) for k, tip in enumerate(tips_of(self._calibration.library, found)) if found.is_sure(k)]
        touches = [touch for touch in touches if self._is_seen(touch, field)]
        if score < STANDS_OUT:  # what is left of a touch that has ended may be fitted by the shallowest press that there is
            touches = [touch for touch in touches if touch.depth > SURE * touch.depth_sigma]
            if not touches:
                self._choice = Choice()
        if len(found.presses) == len(touches) == 1:
            touches = [replace(touches[0], wrench=_wrench_of(found, touches[0].position))]
        return touches

    def _explained(self, field: MarkerField, start: list[Press], motion: np.ndarray | None) -> Inverse:
        """The presses that explain a field; start: of one."""
        seen = Seen(field, motion)

        def two() -> Inverse:
            straight = self._inverse.solve(seen, self._start.best_pair(field))
            return self._inverse.solve(seen, straight.presses, drags=True)  # each draws the sheet along under the other

        return self._choice.explain(
            Evidence(seen.value.size, ORDINARY), lambda start, what: self._inverse.solve(seen, start, what is DRAGGED), start, two)

    def _is_seen(self, touch: TouchEstimate, field: MarkerField) -> bool:
        """Whether markers around a touch are seen: of a touch that begins between two exposures, one camera may show none."""
        away = np.abs(field.rest[field.seen] - touch.position[:2]) / self._margin
        return bool(away.max(axis=1).min() < UNSEEN)

    def _motion(self, field: MarkerField) -> np.ndarray | None:
        """(K, 3) change of shift and growth since the frame before, of markers that a second camera sees, else 0; None with one."""
        if len(self._calibration.camera_centres.camera_centres) < 2:
            return None
        now, before = np.column_stack([field.shift, field.growth]), self._before
        self._before = now
        moved = np.zeros_like(now) if before is None or len(before) != len(now) else np.nan_to_num(now - before)
        return np.where((self._calibration.camera_centres.number(field) > 0)[:, None], moved, 0.0)

    def _touch(self, found: Tip, misfit: float) -> TouchEstimate:
        calibration = self._calibration
        extra = np.array([calibration.place_error, calibration.place_error, calibration.depth_share * found.depth])
        turned = np.diag([1.0, 1.0, -1.0])  # deeper is lower
        covariance = turned @ (found.covariance + np.diag(extra**2)) @ turned
        radius = float(calibration.library.plan.radius * np.exp(found.log_radius))
        flags = self._flags(np.append(found.place[:2], found.depth)) | AMBIGUOUS * (misfit > UNEXPLAINED)
        return TouchEstimate(found.place, float(found.depth), covariance, float(np.sqrt(covariance[2, 2])), radius, flags)

    def _flags(self, tip: np.ndarray) -> int:
        low, high = self._calibration.place_range
        outside = (tip[:2] < low - self._margin).any() or (tip[:2] > high + self._margin).any()
        flags = OUT_OF_RANGE if outside or tip[2] > BEYOND * self._calibration.deepest else 0
        return flags | (AT_EDGE if (np.abs(tip[:2]) >= EDGE * self._calibration.library.plan.reach).any() else 0)


def _wrench_of(found: Inverse, position: np.ndarray) -> np.ndarray:
    """(6,) wrench at the origin, over shear modulus and thickness, m and m^2, of one press with its tip at position (3,), m."""
    stiffness, x, y, *about = found.wrenches[0, :6]
    push = found.presses[0].depth * np.exp(stiffness)
    force = push * np.array([x, y, -1.0])
    return np.concatenate([force, cross(position, force) + push * np.array(about)])
