# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The touch methods by name.

Each class has fit(presses: Presses, sensor: MarkerSensor) -> dict (numbers for the calibration file) and
from_fitted(fitted: dict, sensor: MarkerSensor) -> TouchMethod; one that takes long may have fit_quickly(presses, sensor, fitted) too.
"""
from __future__ import annotations

from collections.abc import Mapping

from ..errors import BadArgument
from .estimate import TouchMethod
from .paper_cushion import PaperCushion
from .paper_touch import PaperTouch
from .regression import RegressionTouch
from .sensor import MarkerSensor
from .sheet_touch import SheetModelMethod

TOUCH_METHODS: dict[str, type] = {'paper': PaperTouch, 'paper_cushion': PaperCushion, 'regression': RegressionTouch,
                                  'model': SheetModelMethod}
_FOR_SHEETS = {'paper': True, 'paper_cushion': False, 'model': True}  # methods that are for one kind of surface


def methods_for(sensor: MarkerSensor) -> dict[str, type]:
    """The methods that fit a sensor's kind of surface."""
    return {name: method for name, method in TOUCH_METHODS.items() if _FOR_SHEETS.get(name, sensor.is_sheet) == sensor.is_sheet}


def make_method(name: str, fitted: Mapping, sensor: MarkerSensor) -> TouchMethod:
    """The method of that name with its numbers from a calibration file. Raises BadArgument for a name that is not in the table."""
    if name not in TOUCH_METHODS:
        raise BadArgument(f'no touch method {name!r}; there are {", ".join(sorted(TOUCH_METHODS))}')
    return TOUCH_METHODS[name].from_fitted(fitted, sensor)
