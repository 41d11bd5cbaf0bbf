# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of the touchpad's perception, and of the tracker of all dots: what the sensor is, how dots are found, how contact is told.

Nodes and tools read these tables. All are fixed at start: a change of the sensor is a new start.
"""
from __future__ import annotations

from functools import partial

from tactile_driver.parameters.table import Parameter

from ..dots.detect.methods import METHODS, POLARITIES
from ..dots.index.methods import METHODS as NUMBERING, WITHOUT_GRID
from ..touchpad.contact.methods import CONTACT_METHODS
from ..touchpad.membrane.solver import PACES

_fixed = partial(Parameter, read_only=True)

SENSOR_PARAMETERS = (
    _fixed('sensor_type', str, 'touchpad', '', 'kind of sensor; a calibration file has to be for the same'),
    _fixed('rows', int, 23, '', 'rows of the printed grid; 0 with columns 0: the pattern is no grid', 0, 250),
    _fixed('columns', int, 23, '', 'columns of the printed grid', 0, 250),
    _fixed('surface', str, 'cap', '', 'rest shape that places dots in 3D: cap of a touchpad, flat sheet, air dome, or none (image only)',
           choices=('cap', 'sheet', 'dome', 'none')),
    _fixed('cap.curvature_radius', float, 0.020, 'm', 'cap: radius of the sphere', 1e-4, 10.0),
    _fixed('cap.height', float, 0.013, 'm', 'cap: height over the rim', 1e-4, 10.0),
    _fixed('camera.rotation', list[float], [0.0, 0.0, 0.0], 'rad', 'rotation vector from sensor to camera frame', -10.0, 10.0),
    _fixed('camera.translation', list[float], [0.0, 0.0, 0.04], 'm', "sensor frame's origin in the camera frame", -10.0, 10.0),
    _fixed('membrane.shear_stiffness', float, 90.0, 'N/m', 'shear modulus times thickness of the membrane', 1e-3, 1e6),
    _fixed('membrane.rest_pressure', float, 2000.0, 'Pa', "the fluid's pressure over the outside while nothing touches", 1e-3, 1e7),
    _fixed('calibration', str, '', '', 'calibration file from calibrate; empty: the known rest shape alone'),
)

SHEET_PARAMETERS = (
    _fixed('pitch', list[float], [0.0045, 0.0045], 'm', 'from marker to marker along x and y', 1e-5, 1.0),
    _fixed('sheet_size', list[float], [0.060, 0.045], 'm', 'of the clamped sheet along x and y; zeros for a dome', 0.0, 10.0),
    _fixed('dome.rim_radius', float, 0.0, 'm', 'radius of the rim of a dome; 0 for a sheet', 0.0, 10.0),
    _fixed('dome.height', float, 0.0, 'm', 'height of a dome over its rim; 0 for a sheet', 0.0, 10.0),
)

DOT_PARAMETERS = SENSOR_PARAMETERS + SHEET_PARAMETERS + (
    _fixed('polarity', str, 'dark', '', 'dots darker or brighter than the ground', choices=tuple(POLARITIES)),
    _fixed('detection', str, 'likelihood', '', 'method that finds dots', choices=tuple(METHODS)),
    _fixed('numbering', str, 'lattice', '', 'method that numbers dots; tracks, register: patterns that are no grid',
           choices=(*NUMBERING, *WITHOUT_GRID)),
    _fixed('pace', str, 'full', '', 'steps that work out places: full; fast: fewer, more false contacts', choices=tuple(PACES)),
    _fixed('reference.frames', int, 10, '', 'untouched frames that are averaged for the reference', 1, 1000),
    _fixed('reference.time_constant', float, 30.0, 's', 'how fast slow drift is followed while nothing touches', 0.1, 1e6),
)

REGION_PARAMETERS = SENSOR_PARAMETERS + (
    _fixed('contact', str, 'membrane', '', 'method that tells which dots touch, stick and slip', choices=tuple(CONTACT_METHODS)),
    _fixed('paper.d_max', float, 0.91e-3, 'm', 'paper: movement that makes an interval long enough (D_max, eq 10)', 1e-6, 1.0),
    _fixed('paper.delta_d', float, 0.19e-3, 'm', 'paper: threshold of the tests (delta_d, eqs 12 and 14)', 1e-7, 1.0),
)
