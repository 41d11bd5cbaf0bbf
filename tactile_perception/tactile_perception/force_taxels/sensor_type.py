# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor type `force_taxels`: taxels that measure a force vector each, on flat or curved patches."""
from ..core.sensor_type import SensorType

FORCE_TAXELS = SensorType(
    driver='force_taxel_node',
    perception='force_contact_node',
    view='force_markers_node',
    raw={'topic': 'taxels'},
    sources=('sim', 'device', 'file', 'bag', 'topics'),
    arguments={'layout': 'YAML file with the positions of the taxels; empty: what the parameter file says'},
    uncalibrated='regions and slip are reported, forces are unknown; record a weight along each axis',
    calibration_parameters=('sensor_type',),
    calibrate='tactile_perception.force_taxels.tools:calibrate_weights',
    calibrate_options=('weight',),
)
