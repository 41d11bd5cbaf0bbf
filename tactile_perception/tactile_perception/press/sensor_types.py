# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor types with printed markers: sheets over one and two cameras, and the inflated dome."""
from functools import partial

from ..core.sensor_type import CAMERA_INFO, CAMERA_POSE, CAMERA_SOURCES, SensorType

_RATE = 3.0  # Hz of the calibration scenes: two to four frames per depth
_MARKER_SENSOR = partial(
    SensorType,
    perception='press_contact_node',
    uncalibrated='markers are tracked, contacts are not reported; record presses at known positions',
    sources=CAMERA_SOURCES,
    calibrate='tactile_perception.press.tools:calibrate_markers',
    pressed_surface='tactile_perception.press.parameters:read_marker_sensor',
    parameters='tactile_perception.press.parameters:MARKER_SENSOR_PARAMETERS',
)
_SHEET = partial(_MARKER_SENSOR, calibration_parameters=('rows', 'columns', 'pitch', 'sheet_size'), calibrate_options=('plate',))

AREAL_SINGLE = _SHEET('camera_node', arguments=CAMERA_INFO, calibration_scene=('areal_single_calibration', _RATE, {}))
AREAL_DUAL = _SHEET(
    'dual_camera_node',
    raw={'topic': 'left/image_raw', 'right_topic': 'right/image_raw'},
    arguments={**CAMERA_INFO,
               'right_device': 'device: the right camera; device is the left one',
               'right_path': 'file: the right video or folder of images',
               'right_topic': 'bag, topics: the right images; topic has the left ones'},
    stitched=True,
    calibration_scene=('areal_dual_calibration', _RATE, {}),
)
AIR_CUSHION = _MARKER_SENSOR(
    'camera_node',
    arguments=CAMERA_INFO,
    calibration_parameters=('rows', 'columns', 'dome.rim_radius', 'dome.height', *CAMERA_POSE),
    calibration_scene=('air_cushion_calibration', _RATE, {}),
)
