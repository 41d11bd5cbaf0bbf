# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Registry of the methods, for each kind of surface."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from tactile_driver.plugins import PluginTable

from ..common.marker_sensor import MarkerSensor
from ..core.errors import BadArgument
from .calibration import restored, stored
from .dome.calibration import calibrate_dome
from .dome.model import DomeCalibration, DomeModelMethod
from .estimate import TouchMethod
from .presses import Presses
from .sheet.calibration import calibrate_sheet
from .sheet.model import SheetCalibration, SheetModelMethod


class Method(NamedTuple):
    """A method and its calibration.

    Attributes
    ----------
    calibrate : callable
        Function of (presses, sensor, known) that returns a calibration; known: a calibration whose simulated library is reused, or None.
    calibration : type
        Dataclass of the calibration.
    method : callable
        Function of (calibration, sensor) that returns the TouchMethod.
    contact_filter : callable, optional
        Makes an object with update(estimates, ids, stamp_s) -> estimates, which smooths contacts from frame to frame.
    """

    calibrate: Callable
    calibration: type
    method: Callable
    contact_filter: Callable | None = None

    def fit(self, presses: Presses, sensor: MarkerSensor, fitted: Mapping | None = None) -> dict:
        """Fit the numbers of the calibration file.

        fitted: those of more presses of the same sensor, whose simulated library is reused because a few numbers determine it. Raises
        BadCalibration if the presses do not determine the method.
        """
        return stored(self.calibrate(presses, sensor, restored(self.calibration, fitted) if fitted else None))

    def from_fitted(self, fitted: Mapping, sensor: MarkerSensor) -> TouchMethod:
        """Make the method from numbers of a calibration file. Raises BadCalibration if they are invalid."""
        return self.method(restored(self.calibration, fitted), sensor)


#: Name -> method, of each kind of surface.
SHEET_METHODS: Mapping[str, Method] = PluginTable('tactile_perception.sheet_methods', {
    'paper': 'tactile_perception.published.areal_sensor_contact_position:METHOD',
    'model': Method(calibrate_sheet, SheetCalibration, SheetModelMethod),
})
DOME_METHODS: Mapping[str, Method] = PluginTable('tactile_perception.dome_methods', {
    'paper_cushion': 'tactile_perception.published.air_cushion_contact:METHOD',
    'model': Method(calibrate_dome, DomeCalibration, DomeModelMethod),
})
#: Names of all methods of this project.
METHOD_NAMES = tuple(dict.fromkeys((*SHEET_METHODS.own, *DOME_METHODS.own)))


def methods_for(sensor: MarkerSensor) -> Mapping[str, Method]:
    """Select the methods for a sensor's kind of surface."""
    return SHEET_METHODS if sensor.is_sheet else DOME_METHODS


def make_method(name: str, fitted: Mapping, sensor: MarkerSensor) -> TouchMethod:
    """Make a method by name with its numbers from a calibration file.

    Raises BadArgument for a name that is unknown or of another kind of surface.
    """
    methods = methods_for(sensor)
    if name not in methods:
        raise BadArgument(f'no touch method {name!r} for a {sensor.type}; choose one of {", ".join(methods)}')
    return methods[name].from_fitted(fitted, sensor)
