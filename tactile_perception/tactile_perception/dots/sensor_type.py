# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor type `dots`: a camera over dots of a sensor that has no type of its own."""
from ..core.sensor_type import CAMERA_INFO, CAMERA_SOURCES, SensorType

DOTS = SensorType(
    driver='camera_node',
    perception='dot_tracker_node',
    params='marker_video.yaml',
    rviz='touchpad',
    sources=CAMERA_SOURCES,
    arguments=CAMERA_INFO,
    parameters='tactile_perception.dots.parameters:DOT_SENSOR_PARAMETERS',
)
