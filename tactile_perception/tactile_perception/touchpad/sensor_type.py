# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor type `touchpad`."""
from ..core.sensor_type import CAMERA_INFO, CAMERA_POSE, CAMERA_SOURCES, SensorType

TOUCHPAD = SensorType(
    driver='camera_node',
    perception='touchpad_contact_node',
    sources=CAMERA_SOURCES,
    arguments=CAMERA_INFO,
    parameters='tactile_perception.touchpad.parameters:TOUCHPAD_SENSOR_PARAMETERS',
    calibration_parameters=('rows', 'columns', 'cap.curvature_radius', 'cap.height', *CAMERA_POSE),
    calibrate='tactile_perception.touchpad.tools:calibrate_touchpad',
    calibrate_options=('sphere_radius',),
    pressed_surface='tactile_perception.touchpad.tools:pressed_cap',
    has_motion=True,
)
