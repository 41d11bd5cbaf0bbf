# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of press_contact_node: geometry of the sheet or dome, touch estimation. All are fixed at start."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ..common.marker_sensor import MARKER_SENSORS, MarkerSensor
from ..core.errors import BadArgument
from ..core.parameter_files import read_parameters
from ..dots.parameters import camera_pose_parameters, detection_parameters, fixed, pattern_parameters
from .methods import METHOD_NAMES

AUTO = 'auto'
NODE = 'press_contact_node'

MARKER_SENSOR_PARAMETERS = (
    *pattern_parameters(next(iter(MARKER_SENSORS)), 9, 13, tuple(MARKER_SENSORS)),
    fixed('pitch', list[float], [0.0045, 0.0045], 'm', 'distance between markers along x and y', 1e-5, 1.0),
    fixed('sheet_size', list[float], [0.060, 0.045], 'm', 'size of the clamped sheet along x and y; zeros for a dome', 0.0, 10.0),
    fixed('dome.rim_radius', float, 0.0, 'm', 'radius of the rim of a dome; 0 for a sheet', 0.0, 10.0),
    fixed('dome.height', float, 0.0, 'm', 'height of a dome above its rim; 0 for a sheet', 0.0, 10.0),
    *camera_pose_parameters(0.062),
    fixed('calibration', str, '', '', 'calibration file from calibrate; empty: contacts are not reported'),
)

MARKER_PARAMETERS = MARKER_SENSOR_PARAMETERS + detection_parameters('bright', 'blobs', 'lattice') + (
    fixed('touch', str, AUTO, '', 'touch estimation method; auto: the one that cross-validation chose when it was calibrated',
          choices=(AUTO, *METHOD_NAMES)),
    fixed('paper.kalman', bool, False, '', 'touch paper, of sheets: Kalman filter on the positions of contacts'),
    fixed('tip_radius', float, 0.008, 'm', 'tip radius assumed for the contact region where the method does not estimate it', 1e-4, 1.0),
)


def read_marker_sensor(params: Path) -> MarkerSensor:
    """Read the sensor that a parameter file describes. Raises BadArgument for an inconsistent geometry."""
    return marker_sensor(read_parameters(params, NODE, MARKER_SENSOR_PARAMETERS))


def marker_sensor(values: Mapping) -> MarkerSensor:
    """Make the sensor that values (of MARKER_SENSOR_PARAMETERS) describe. Raises BadArgument for an inconsistent geometry."""
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
