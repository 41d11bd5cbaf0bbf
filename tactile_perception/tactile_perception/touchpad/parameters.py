# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of touchpad_contact_node: geometry and material of the touchpad, its dots, and the method of contact."""
from __future__ import annotations

from ..dots.parameters import camera_pose_parameters, detection_parameters, fixed, pattern_parameters
from .contact import CONTACT_METHODS

NODE = 'touchpad_contact_node'

TOUCHPAD_SENSOR_PARAMETERS = (
    *pattern_parameters('touchpad', 23, 23),
    fixed('cap.curvature_radius', float, 0.020, 'm', 'radius of the sphere of which the untouched cap is a part', 1e-4, 10.0),
    fixed('cap.height', float, 0.013, 'm', 'height of the cap above its rim', 1e-4, 10.0),
    *camera_pose_parameters(0.04),
    fixed('membrane.shear_stiffness', float, 90.0, 'N/m', 'shear modulus times thickness of the membrane', 1e-3, 1e6),
    fixed('membrane.rest_pressure', float, 2000.0, 'Pa', 'gauge pressure of the fluid while nothing touches', 1e-3, 1e7),
    fixed('calibration', str, '', '', 'calibration file from calibrate; empty: untouched shape only'),
)

TOUCHPAD_PARAMETERS = TOUCHPAD_SENSOR_PARAMETERS + detection_parameters('dark', 'likelihood', 'lattice') + (
    fixed('reference_file', str, '', '', 'keeps the image of the reference (.npy), which a node that starts again takes; empty: none'),
    fixed('contact', str, 'membrane', '', 'method that classifies dots as free, sticking or slipping', choices=CONTACT_METHODS),
    fixed('paper.d_max', float, 0.91e-3, 'm', 'paper: displacement that ends an interval (D_max, eq 10)', 1e-6, 1.0),
    fixed('paper.delta_d', float, 0.19e-3, 'm', 'paper: threshold of the tests (delta_d, eqs 12 and 14)', 1e-7, 1.0),
)
