# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The installed files of a sensor type, in the package that has the type."""
from __future__ import annotations

from tactile_perception.core.sensor_type import SENSOR_TYPES

from . import share


def parameter_file(sensor_type: str, simulated: bool) -> str:
    """The path of the parameters of a real sensor, or of the simulated one."""
    kind = SENSOR_TYPES[sensor_type]
    return share('params', f'{sensor_type}_sim.yaml' if simulated else kind.params or f'{sensor_type}.yaml', package=kind.package)


def simulated_calibration(sensor_type: str) -> str:
    """The path of the calibration of the simulated sensor; a type that is not calibrated has no such file."""
    return share('calibration', f'{sensor_type}_sim.yaml', package=SENSOR_TYPES[sensor_type].package)


def rviz_file(sensor_type: str) -> tuple[str, str]:
    """The path of the RViz configuration, and the namespace and frame that it is written for."""
    kind = SENSOR_TYPES[sensor_type]
    drawn = kind.rviz or sensor_type
    return share('rviz', f'{drawn}.rviz', package=kind.package), drawn
