# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of dot_tracker_node and contact_region_node: geometry of the sensor, dot detection, contact estimation.

Nodes and tools read these tables. All parameters are fixed at start.
"""
from __future__ import annotations

from functools import partial

from tactile_driver.parameters.table import Parameter

from ..dots.detect import METHODS, POLARITIES
from ..dots.number import AUTO, METHODS as NUMBERING, WITHOUT_GRID
from ..touchpad.contact import CONTACT_METHODS

_fixed = partial(Parameter, read_only=True)

SENSOR_PARAMETERS = (
    _fixed('sensor_type', str, 'touchpad', '', 'sensor type; a calibration file must be for the same type'),
    _fixed('rows', int, 23, '', 'rows of the printed grid; rows and columns 0: the pattern is not a grid', 0, 250),
    _fixed('columns', int, 23, '', 'columns of the printed grid', 0, 250),
    _fixed('surface', str, 'cap', '',
           'untouched shape, for places in 3D: cap of a touchpad, flat sheet, inflated dome; gel: elastic layer, pins: dome of pins, in '
           'the image; none: image places only', choices=('cap', 'sheet', 'dome', 'gel', 'pins', 'none')),
    _fixed('cap.curvature_radius', float, 0.020, 'm', 'cap: radius of the sphere', 1e-4, 10.0),
    _fixed('cap.height', float, 0.013, 'm', 'cap: height above the rim', 1e-4, 10.0),
    _fixed('camera.rotation', list[float], [0.0, 0.0, 0.0], 'rad', 'rotation vector from sensor to camera frame', -10.0, 10.0),
    _fixed('camera.translation', list[float], [0.0, 0.0, 0.04], 'm', "sensor frame's origin in the camera frame", -10.0, 10.0),
    _fixed('membrane.shear_stiffness', float, 90.0, 'N/m', 'shear modulus times thickness of the membrane', 1e-3, 1e6),
    _fixed('membrane.rest_pressure', float, 2000.0, 'Pa', "gauge pressure of the fluid while nothing touches", 1e-3, 1e7),
    _fixed('calibration', str, '', '', 'calibration file from calibrate; empty: untouched shape only'),
)

SHEET_PARAMETERS = (
    _fixed('pitch', list[float], [0.0045, 0.0045], 'm', 'distance between markers along x and y', 1e-5, 1.0),
    _fixed('sheet_size', list[float], [0.060, 0.045], 'm', 'size of the clamped sheet along x and y; zeros for a dome', 0.0, 10.0),
    _fixed('dome.rim_radius', float, 0.0, 'm', 'radius of the rim of a dome; 0 for a sheet', 0.0, 10.0),
    _fixed('dome.height', float, 0.0, 'm', 'height of a dome above its rim; 0 for a sheet', 0.0, 10.0),
)

DOT_PARAMETERS = SENSOR_PARAMETERS + SHEET_PARAMETERS + (
    _fixed('frame_id', str, '', '', 'sensor frame, in which all results are; empty: named as the namespace, with _ for /'),
    _fixed('polarity', str, 'dark', '', 'dots darker or brighter than the background; any: detection auto measures it',
           choices=tuple(POLARITIES)),
    _fixed('detection', str, 'likelihood', '', 'dot detection method', choices=tuple(METHODS)),
    _fixed('mask', str, '', 'px', 'what of the image shows the sensor: an image file of its size, white there, or a polygon x,y,x,y,...; '
           'empty: all'),
    _fixed('numbering', str, 'lattice', '', 'dot indexing method; auto: finds a grid, else tracks; tracks, register, sort: other patterns',
           choices=(AUTO, *NUMBERING, *WITHOUT_GRID)),
    _fixed('reference.frames', int, 10, '', 'untouched frames averaged for the reference', 1, 1000),
    _fixed('reference.time_constant', float, 30.0, 's',
           'time constant with which the reference follows drift while nothing touches', 0.1, 1e6),
)

#: Of an elastic layer with dots (surface gel); how to measure them: docs/gel.md.
GEL_PARAMETERS = (
    _fixed('gel.thickness', float, 0.0, 'm',
           'of the elastic layer, from its rigid base to its free surface; 0: unknown, then depth is NaN', 0.0, 1.0),
    _fixed('gel.dot_depth', float, 0.0, 'm', 'of the dots under the free surface', 0.0, 1.0),
    _fixed('gel.young_modulus', float, 0.0, 'Pa', "Young's modulus; 0: unknown, then forces are NaN", 0.0, 1e9),
    _fixed('gel.poisson_ratio', float, 0.48, '', "Poisson's ratio; of silicones and gels 0.47 to 0.5", 0.0, 0.5),
    _fixed('gel.friction', float, 0.0, '', 'friction coefficient of object and gel; 0: unknown, then no slip is reported', 0.0, 10.0),
    _fixed('gel.scale', float, 0.0, 'm', 'length on the gel that one pixel shows; 0: from gel.pitch, or from camera.translation', 0.0, 0.1),
    _fixed('gel.pitch', float, 0.0, 'm', 'distance of neighbouring dots; tells the scale where gel.scale is 0', 0.0, 0.1),
)

REGION_PARAMETERS = SENSOR_PARAMETERS + GEL_PARAMETERS + (
    _fixed('contact', str, 'membrane', '', 'method that classifies dots as free, sticking or slipping', choices=CONTACT_METHODS),
    _fixed('paper.d_max', float, 0.91e-3, 'm', 'paper: displacement that ends an interval (D_max, eq 10)', 1e-6, 1.0),
    _fixed('paper.delta_d', float, 0.19e-3, 'm', 'paper: threshold of the tests (delta_d, eqs 12 and 14)', 1e-7, 1.0),
)
