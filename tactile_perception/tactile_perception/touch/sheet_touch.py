# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Touches of a sheet by its mechanics: the presses that explain the whole field of markers, told with their uncertainty."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .estimate import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, TouchEstimate
from .field import MarkerField
from .presses import Presses
from .sensor import MarkerSensor
from .sheet_calibration import QUICK, SheetCalibration, calibrate_sheet
from .sheet_inverse import SheetInverse
from .sheet_several import SheetPresses, Tip, tips_of
from .sheet_start import SheetStart

FEWEST = 10    # markers seen, below which nothing is told
STANDS_OUT = 8.0  # sigmas by which a field must stand out of the noise
SURE = 4.0     # sigmas by which the depth must
BEYOND = 1.02  # of the calibrated depth, from where on it is out of range
UNEXPLAINED = 8.0  # misfit, above which there may be several touches
EDGE = 0.999   # of the reach of the library


class SheetModelMethod:
    """The 'model' method for sheets: see sheet_model, sheet_library, sheet_inverse."""

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
