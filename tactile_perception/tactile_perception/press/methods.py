# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Registry of touch methods."""
from __future__ import annotations

from collections.abc import Mapping

from ..errors import BadArgument
from .dome.method import DomeModelMethod
from .sheet.method import SheetModelMethod
from .published.dome import PaperCushion
from .published.sheet import PaperTouch
from .presses import Presses
from .estimate import TouchMethod
from .sensor import MarkerSensor


class ModelTouch:
    """The mechanics of the sensor's shape; raises BadCalibration for presses that do not determine it or an unreadable calibration."""

    @staticmethod
    def _of(sensor: MarkerSensor) -> type:
        return SheetModelMethod if sensor.is_sheet else DomeModelMethod

    @staticmethod
    def fit(presses: Presses, sensor: MarkerSensor) -> dict:
        """Parameters for the calibration file."""
        return ModelTouch._of(sensor).fit(presses, sensor)

    @staticmethod
    def fit_quickly(presses: Presses, sensor: MarkerSensor, fitted: Mapping) -> dict:
        """As fit, from the parameters fitted to more presses."""
        return ModelTouch._of(sensor).fit_quickly(presses, sensor, fitted)

    @staticmethod
    def from_fitted(fitted: Mapping, sensor: MarkerSensor) -> TouchMethod:
        """From the calibration file."""
        return ModelTouch._of(sensor).from_fitted(fitted, sensor)


TOUCH_METHODS: dict[str, type] = {'paper': PaperTouch, 'paper_cushion': PaperCushion, 'model': ModelTouch}
_FOR_SHEETS = {'paper': True, 'paper_cushion': False}  # methods for one kind of surface: True sheets, False domes


def methods_for(sensor: MarkerSensor) -> dict[str, type]:
    """The methods for a sensor's kind of surface."""
    return {name: method for name, method in TOUCH_METHODS.items() if _FOR_SHEETS.get(name, sensor.is_sheet) == sensor.is_sheet}


def make_method(name: str, fitted: Mapping, sensor: MarkerSensor) -> TouchMethod:
    """The method of that name with its parameters from a calibration file. Raises BadArgument for an unknown name."""
    if name not in TOUCH_METHODS:
        raise BadArgument(f'unknown touch method {name!r}; choose one of {", ".join(sorted(TOUCH_METHODS))}')
    return TOUCH_METHODS[name].from_fitted(fitted, sensor)
