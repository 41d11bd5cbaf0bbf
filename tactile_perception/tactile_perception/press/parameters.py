# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of contact_point_node: geometry of the sheet or dome, touch estimation. All are fixed at start."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

from tactile_driver.parameters.table import Parameter

from ..errors import BadArgument
from .methods import METHOD_NAMES
from .sensor import MARKER_SENSORS, MarkerSensor
from ..parameters.file import read_parameters
from ..parameters.touchpad import SHEET_PARAMETERS

AUTO = 'auto'
_fixed = partial(Parameter, read_only=True)

MARKER_SENSOR_PARAMETERS = (
    _fixed('sensor_type', str, next(iter(MARKER_SENSORS)), '', 'sensor type; a calibration file must be for the same type',
           choices=tuple(MARKER_SENSORS)),
    _fixed('rows', int, 9, '', 'rows of the printed grid; rows and columns 0: the pattern is not a grid', 0, 250),
    _fixed('columns', int, 13, '', 'columns of the printed grid', 0, 250),
    *SHEET_PARAMETERS,
    _fixed('camera.rotation', list[float], [0.0, 0.0, 0.0], 'rad', 'dome: rotation vector from sensor to camera frame', -10.0, 10.0),
    _fixed('camera.translation', list[float], [0.0, 0.0, 0.062], 'm', "dome: sensor frame's origin in the camera frame", -10.0, 10.0),
    _fixed('calibration', str, '', '', 'calibration file from calibrate'),
)

POINT_PARAMETERS = MARKER_SENSOR_PARAMETERS + (
    _fixed('touch', str, AUTO, '', 'touch estimation method; auto: the one that cross-validation chose when it was calibrated',
           choices=(AUTO, *METHOD_NAMES)),
    _fixed('paper.kalman', bool, False, '', 'touch paper, of sheets: Kalman filter on the positions of contacts'),
    _fixed('tip_radius', float, 0.008, 'm', "tip radius assumed for the contact region where the method does not estimate it", 1e-4, 1.0),
)


def read_marker_sensor(params: Path) -> MarkerSensor:
    """The sensor that a parameter file describes. Raises BadArgument for an inconsistent geometry."""
    return marker_sensor(read_parameters(params, 'contact_point_node', MARKER_SENSOR_PARAMETERS))


def marker_sensor(values: Mapping) -> MarkerSensor:
    """The sensor that values (of MARKER_SENSOR_PARAMETERS or DOT_PARAMETERS) describe. Raises BadArgument for an inconsistent geometry."""
    kind = MARKER_SENSORS.get(values['sensor_type'])
    pitch, size = _pairs(values)
    given = dict(rows=values['rows'], columns=values['columns'], pitch=pitch, size=size, rim_radius=values['dome.rim_radius'],
                 height=values['dome.height'], type=values['sensor_type'])
    return replace(kind, **given) if kind else MarkerSensor(**given)


def _pairs(values: Mapping) -> list[tuple[float, float]]:
    """Pitch (2,) m and sheet size (2,) m."""
    pairs = {name: tuple(values[name]) for name in ('pitch', 'sheet_size')}
    for name, pair in pairs.items():
        if len(pair) != 2:
            raise BadArgument(f'parameter {name} must have two numbers, along x and y, not {len(pair)}')
    return list(pairs.values())
