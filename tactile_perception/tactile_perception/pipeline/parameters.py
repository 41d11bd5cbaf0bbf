# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of the touchpad's perception: what the sensor is, how dots are found, how contact is told. Nodes and tools read these
tables.
"""
from __future__ import annotations

from tactile_driver.nodes.parameters import Parameter

from ..contact.methods import CONTACT_METHODS
from ..dots.detect import METHODS, POLARITIES
from ..dots.numbering import METHODS as NUMBERING
from ..surface.membrane import PACES

SENSOR_PARAMETERS = (
    Parameter('sensor_type', str, 'touchpad', '', 'kind of sensor; a calibration file has to be for the same', read_only=True),
    Parameter('rows', int, 23, '', 'rows of the printed grid; 0 with columns 0: the pattern is no grid', 0, 250, read_only=True),
    Parameter('columns', int, 23, '', 'columns of the printed grid', 0, 250, read_only=True),
    Parameter(
        'surface',
        str,
        'cap',
        '',
        'rest shape that places dots in 3D: spherical cap, or none (image places only)',
        choices=('cap', 'none'),
        read_only=True,
    ),
    Parameter('cap.curvature_radius', float, 0.020, 'm', 'cap: radius of the sphere', 1e-4, 10.0, read_only=True),
    Parameter('cap.height', float, 0.013, 'm', 'cap: height over the rim', 1e-4, 10.0, read_only=True),
    Parameter(
        'camera.rotation',
        list[float],
        [0.0, 0.0, 0.0],
        'rad',
        'rotation vector from sensor to camera frame',
        -10.0,
        10.0,
        read_only=True,
    ),
    Parameter(
        'camera.translation',
        list[float],
        [0.0, 0.0, 0.04],
        'm',
        "sensor frame's origin in the camera frame",
        -10.0,
        10.0,
        read_only=True,
    ),
    Parameter(
        'membrane.shear_stiffness', float, 90.0, 'N/m', 'shear modulus times thickness of the membrane', 1e-3, 1e6, read_only=True
    ),
    Parameter(
        'membrane.rest_pressure',
        float,
        2000.0,
        'Pa',
        "the fluid's pressure over the outside while nothing touches",
        1e-3,
        1e7,
        read_only=True,
    ),
    Parameter('calibration', str, '', '', 'calibration file from calibrate; empty: the known rest shape alone', read_only=True),
)

DOT_PARAMETERS = SENSOR_PARAMETERS + (
    Parameter('polarity', str, 'dark', '', 'dots darker or brighter than the ground', choices=tuple(POLARITIES), read_only=True),
    Parameter('detection', str, 'likelihood', '', 'method that finds dots', choices=tuple(METHODS), read_only=True),
    Parameter('numbering', str, 'lattice', '', 'method that numbers dots on a grid', choices=tuple(NUMBERING), read_only=True),
    Parameter(
        'pace',
        str,
        'full',
        '',
        'how thoroughly places are worked out: full, or fast in half of the time',
        choices=tuple(PACES),
        read_only=True,
    ),
    Parameter('reference.frames', int, 10, '', 'untouched frames that are averaged for the reference', 1, 1000, read_only=True),
    Parameter(
        'reference.time_constant',
        float,
        30.0,
        's',
        'how fast slow drift of the reference is followed while nothing touches',
        0.1,
        1e6,
        read_only=True,
    ),
)

REGION_PARAMETERS = SENSOR_PARAMETERS + (
    Parameter(
        'contact',
        str,
        'membrane',
        '',
        'method that tells which dots touch, stick and slip',
        choices=tuple(CONTACT_METHODS),
        read_only=True,
    ),
    Parameter(
        'paper.d_max',
        float,
        0.91e-3,
        'm',
        'paper: movement that makes an interval long enough (D_max, eq 10)',
        1e-6,
        1.0,
        read_only=True,
    ),
    Parameter(
        'paper.delta_d', float, 0.19e-3, 'm', 'paper: threshold of the tests (delta_d, eqs 12 and 14)', 1e-7, 1.0, read_only=True
    ),
)
