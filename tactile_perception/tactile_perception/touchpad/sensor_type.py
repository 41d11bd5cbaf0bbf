# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor type `touchpad`."""
from ..sensor_type import CAMERA_INFO, CAMERA_POSE, CAMERA_SOURCES, SensorType

TOUCHPAD = SensorType(
    driver='camera_node',
    perception=('dot_tracker_node', 'contact_region_node'),
    needs='surface',
    sources=CAMERA_SOURCES,
    arguments=CAMERA_INFO,
    calibration_parameters=('rows', 'columns', 'surface', 'cap.curvature_radius', 'cap.height', *CAMERA_POSE),
    calibrate='tactile_perception.touchpad.tools:calibrate_touchpad',
    calibrate_options=('sphere_radius',),
    pressed_surface='tactile_perception.touchpad.tools:pressed_cap',
)
