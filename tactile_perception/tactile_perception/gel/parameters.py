# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of gel_contact_node and pins_contact_node. docs/gel.md says how those of a gel are measured."""
from __future__ import annotations

from ..dots.parameters import camera_pose_parameters, detection_parameters, fixed, pattern_parameters
from ..layer.parameters import LAYER_PARAMETERS

_PITCH = fixed('gel.pitch', float, 0.0, 'm', 'distance of neighbouring dots; gives the scale if gel.scale is 0', 0.0, 0.1)
_SCALE = fixed('gel.scale', float, 0.0, 'm',
               'length on the gel that one pixel shows; 0: computed from gel.pitch, or from camera.translation', 0.0, 0.1)

GEL_NODE, PINS_NODE = 'gel_contact_node', 'pins_contact_node'

GEL_SENSOR_PARAMETERS = (
    *pattern_parameters('gel'),
    *camera_pose_parameters(0.0),
    fixed('calibration', str, '', '', 'calibration file from calibrate, whose modulus replaces gel.young_modulus; empty: none'),
)
GEL_PARAMETERS = GEL_SENSOR_PARAMETERS + detection_parameters() + (
    *LAYER_PARAMETERS,
    fixed('gel.young_modulus', float, 0.0, 'Pa', "Young's modulus; 0: unknown, forces are NaN", 0.0, 1e9),
    _SCALE, _PITCH,
)

PINS_SENSOR_PARAMETERS = (
    *pattern_parameters('pins'),
    fixed('calibration', str, '', '', 'calibration file from calibrate; empty: position and depth are NaN'),
)
PINS_PARAMETERS = PINS_SENSOR_PARAMETERS + detection_parameters(numbering='register') + (_SCALE, _PITCH)
