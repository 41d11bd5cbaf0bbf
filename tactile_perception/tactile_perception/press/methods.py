# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Registry of the methods, for each kind of surface."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from ..errors import BadArgument
from .dome.calibration import fit_dome
from .dome.model import DomeModelMethod
from .estimate import TouchMethod
from .published import PaperCushion, PaperTouch
from .sensor import MarkerSensor
from .sheet.calibration import fit_sheet
from .sheet.model import SheetModelMethod


class Model(NamedTuple):
    """fit: presses, sensor and numbers fitted before or None -> numbers of the calibration file; from_fitted: of these and the sensor, the
    TouchMethod."""

    fit: Callable
    from_fitted: Callable


#: Name -> method, of each kind of surface.
SHEET_METHODS = {'paper': PaperTouch, 'model': Model(fit_sheet, SheetModelMethod.from_fitted)}
DOME_METHODS = {'paper_cushion': PaperCushion, 'model': Model(fit_dome, DomeModelMethod.from_fitted)}
#: Names of all methods.
METHOD_NAMES = tuple(dict.fromkeys((*SHEET_METHODS, *DOME_METHODS)))


def methods_for(sensor: MarkerSensor) -> dict:
    """The methods for a sensor's kind of surface."""
    return SHEET_METHODS if sensor.is_sheet else DOME_METHODS


def make_method(name: str, fitted: Mapping, sensor: MarkerSensor) -> TouchMethod:
    """The method of that name with its parameters from a calibration file. Raises BadArgument for a name that is unknown or of another
    kind of surface."""
    methods = methods_for(sensor)
    if name not in methods:
        raise BadArgument(f'no touch method {name!r} for a {sensor.type}; choose one of {", ".join(methods)}')
    return methods[name].from_fitted(fitted, sensor)
