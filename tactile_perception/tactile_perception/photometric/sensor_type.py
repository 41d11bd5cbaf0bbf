# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor type `photometric_gel`: a gel with an opaque skin, lit from the sides in several colours, above a camera."""
from ..core.sensor_type import CAMERA_INFO, CAMERA_SOURCES, SensorType

PHOTOMETRIC_GEL = SensorType(
    driver='camera_node',
    perception='photometric_contact_node',
    view='surface_markers_node',
    rviz='touchpad',
    sources=CAMERA_SOURCES,
    arguments=CAMERA_INFO,
    uncalibrated='depth needs a calibration; press a ball of known radius at twenty positions',
    calibration_parameters=('gel.scale',),
    calibrate='tactile_perception.photometric.tools:calibrate_gel',
    loaded='through a ball in the middle of the gel',
    calibrate_options=('sphere_radius', 'weight'),
)
