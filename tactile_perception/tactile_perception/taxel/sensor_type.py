# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor type `taxel_array`."""
from ..core.sensor_type import SensorType

TAXEL_ARRAY = SensorType(
    driver='taxel_array_node',
    perception='taxel_contact_node',
    view='taxel_markers_node',
    uncalibrated='regions, motion and slip are reported, pressure and force are unknown; record known weights',
    calibration_parameters=('rows', 'columns', 'pitch', 'bits'),
    calibrate='tactile_perception.taxel.tools:calibrate_taxels',
    calibration_scene=('plate', 20.0, {}),
    parameters='tactile_perception.taxel.parameters:TAXEL_SENSOR_PARAMETERS',
    loaded='with a flat plate over all taxels',
)
