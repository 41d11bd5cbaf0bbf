# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor type `force_taxels`: taxels that measure a force vector each, on flat or curved patches."""
from ..core.sensor_type import SensorType

_ABOUT = ('# Taxels that measure a force vector each, as XELA uSkin, Paxini, PapillArray: contact region, contacts, slip, wrench.\n'
          '# layout names the file with their positions (docs/force_taxels.md).\n')

FORCE_TAXELS = SensorType(
    driver='force_taxel_node',
    perception='force_contact_node',
    view='force_markers_node',
    raw={'topic': 'taxels'},
    sources=('sim', 'device', 'file', 'bag', 'topics'),
    arguments={'layout': 'YAML file with the positions of the taxels; empty: what the parameter file says'},
    uncalibrated='regions and slip are reported, forces are unknown; record a weight along each axis',
    known_by='force_unit',
    calibration_parameters=('sensor_type',),
    calibrate='tactile_perception.force_taxels.tools:calibrate_weights',
    calibrate_options=('weight',),
    parameters='tactile_perception.force_taxels.parameters:FORCE_SENSOR_PARAMETERS',
    files={'force_taxels': (_ABOUT, {})},
    simulated={'scene': 'demo'},
    simulation='tactile_driver.force_taxels.bag:SCENES',
    calibration_scene=('uskin_weights', 50.0, {}),
)
