# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor type `plate`."""
from tactile_perception.core.sensor_type import SensorType

PLATE = SensorType(
    driver='taxel_array_node',
    perception='plate_node',
    view='taxel_markers_node',
    package='tactile_plate',
    uncalibrated='forces are those of a nominal load cell; record known loads',
    calibration_parameters=('rows', 'columns', 'size'),
    calibrate='tactile_plate.calibration:calibrate_plate',
)
