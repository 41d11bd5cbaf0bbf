# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The contact point by smooth regression of the whole displacement field, for a sheet or a dome."""
from __future__ import annotations

from collections.abc import Mapping

from .estimate import TouchMethod
from .presses import Presses
from .regression_dome import DomeRegression
from .regression_sheet import SheetRegression
from .sensor import MarkerSensor


class RegressionTouch:
    """Chooses by the sensor's shape; both raise BadCalibration for too few presses or numbers that cannot be read."""

    @staticmethod
    def fit(presses: Presses, sensor: MarkerSensor) -> dict:
        """Numbers for the calibration file."""
        return (SheetRegression if sensor.is_sheet else DomeRegression).fit(presses, sensor)

    @staticmethod
    def from_fitted(fitted: Mapping, sensor: MarkerSensor) -> TouchMethod:
        """Back from the calibration file."""
        return (SheetRegression if sensor.is_sheet else DomeRegression).from_fitted(fitted, sensor)
