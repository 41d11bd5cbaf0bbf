# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of psd_contact_node: the finger and its contact estimation. All are fixed at start."""
from __future__ import annotations

from functools import partial

from tactile_driver.parameters.table import Parameter

from ..psd.methods import PSD_METHODS

_fixed = partial(Parameter, read_only=True)

PSD_SENSOR_PARAMETERS = (
    _fixed('sensor_type', str, 'psd_finger', '', 'sensor type; a calibration file must be for the same type', choices=('psd_finger',)),
    _fixed('radius', float, 0.016, 'm', "outer radius of the hemisphere", 1e-4, 1.0),
    _fixed('saturation', float, 4.9, 'V', 'output voltage at which an output saturates', 1e-3, 1e3),
    _fixed('calibration', str, '', '', 'calibration file from calibrate; empty: nominal values'),
)

PSD_PARAMETERS = PSD_SENSOR_PARAMETERS + (
    _fixed('method', str, 'map', '', 'contact estimation method; map: the calibrated map; paper: offset, factor and threshold of the paper',
           choices=tuple(PSD_METHODS)),
    _fixed('results', str, 'batch', '',
           'batch: one result a message and one at each begin and end of a contact; sample: one result a sample',
           choices=('batch', 'sample')),
    _fixed('filter', bool, False, '', 'Kalman filter of constant velocity on the sphere'),
    _fixed('filter.acceleration', float, 50.0, 'rad/s^2',
           'filter: standard deviation of the acceleration; larger follows faster and smooths less', 1e-3, 1e6),
    _fixed('reference.seconds', float, 0.2, 's', 'untouched time at the start, averaged for the reference', 0.001, 60.0),
    _fixed('reference.fastest_drift', float, 0.1, 'V/s',
           'fastest drift of the sum of the outputs that the reference follows while nothing touches', 1e-4, 100.0),
    _fixed('paper.threshold', float, 0.2, 'V', 'paper: sum of the outputs above which something touches', 1e-4, 100.0),
)
