# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor type `psd_finger`."""
from ..core.sensor_type import SensorType

PSD_FINGER = SensorType(
    driver='psd_node',
    perception='psd_contact_node',
    view='finger_markers_node',
    uncalibrated='positions are those of a nominal finger, force and depth are unknown; record presses at known positions',
    raw={'topic': 'voltages'},
    parameters='tactile_perception.finger.parameters:PSD_SENSOR_PARAMETERS',
    calibration_scene=('calibration', 1000.0, {}),
    sources=('sim', 'device', 'bag'),
    calibration_parameters=('radius',),
    calibrate='tactile_perception.finger.tools:calibrate_psd',
    pressed_surface='tactile_perception.finger.tools:read_radius',
)
