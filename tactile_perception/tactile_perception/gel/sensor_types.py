# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor types `gel`, an elastic layer with dots above a camera, and `pins`, a dome of pins above a camera."""
from functools import partial

from ..core.sensor_type import CAMERA_INFO, CAMERA_SOURCES, SensorType

_CAMERA = partial(SensorType, driver='camera_node', rviz='touchpad', sources=CAMERA_SOURCES, arguments=CAMERA_INFO)

GEL = _CAMERA(
    perception='gel_contact_node',
    params='gelsight_mini.yaml',
    parameters='tactile_perception.gel.parameters:GEL_SENSOR_PARAMETERS',
    calibration_parameters=('gel.thickness', 'gel.dot_depth', 'gel.poisson_ratio', 'gel.scale', 'gel.pitch', 'camera.translation'),
    calibrate='tactile_perception.gel.tools:calibrate_weights',
    calibrate_options=('weight',),
    loaded='through a ball in the middle of the gel',
)
PINS = _CAMERA(
    perception='pins_contact_node',
    params='pin_dome.yaml',
    parameters='tactile_perception.gel.parameters:PINS_SENSOR_PARAMETERS',
    calibration_scene=('pins_calib', 4.0, {}),
    uncalibrated='contacts have neither position nor depth; record presses at known positions',
    calibration_parameters=('rows', 'columns'),
    calibrate='tactile_perception.gel.tools:calibrate_pins',
)
