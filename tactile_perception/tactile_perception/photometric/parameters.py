# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of photometric_contact_node. docs/photometric_gel.md says how they are measured."""
from __future__ import annotations

from ..dots.parameters import detection_parameters, fixed, pattern_parameters
from ..layer.parameters import LAYER_PARAMETERS

SENSOR, PHOTOMETRIC_NODE = 'photometric_gel', 'photometric_contact_node'

PHOTOMETRIC_SENSOR_PARAMETERS = (
    *pattern_parameters(SENSOR, choices=(SENSOR,)),
    fixed('gel.scale', float, 0.0, 'm', 'length on the gel that one pixel of the image shows; 0: unknown, nothing is estimated', 0.0, 0.1),
    fixed('calibration', str, '', '', 'calibration file from calibrate; empty: nothing is estimated'),
)
PHOTOMETRIC_PARAMETERS = PHOTOMETRIC_SENSOR_PARAMETERS + (
    fixed('gel.markers', bool, False, '', 'whether dots are printed on the gel: dots are published, and slip where gel.friction is known'),
    *(one for one in detection_parameters() if one.name != 'input'), *LAYER_PARAMETERS,
)
