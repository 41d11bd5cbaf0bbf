# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of psd_contact_node: what the finger is, and how contacts are told. All are fixed at start."""
from __future__ import annotations

from functools import partial

from tactile_driver.parameters.table import Parameter

from ..psd.methods import PSD_METHODS

_fixed = partial(Parameter, read_only=True)

PSD_SENSOR_PARAMETERS = (
    _fixed('sensor_type', str, 'psd_finger', '', 'kind of sensor; a calibration file has to be for the same', choices=('psd_finger',)),
    _fixed('radius', float, 0.016, 'm', "of the hemisphere's outside", 1e-4, 1.0),
    _fixed('saturation', float, 4.9, 'V', 'from which an output tells no more', 1e-3, 1e3),
    _fixed('calibration', str, '', '', 'calibration file from calibrate; empty: nominal values'),
)

PSD_PARAMETERS = PSD_SENSOR_PARAMETERS + (
    _fixed('method', str, 'map', '', 'map: what calibrate fitted; paper: offset, factor and threshold', choices=tuple(PSD_METHODS)),
    _fixed('results', str, 'batch', '', 'contacts of each message and where they begin or end in it, or of each sample',
           choices=('batch', 'sample')),
    _fixed('filter', bool, False, '', 'Kalman filter of constant velocity on the sphere, from result to result'),
    _fixed('filter.acceleration', float, 50.0, 'rad/s^2', 'filter: what a contact may do; more follows faster and smooths less', 1e-3, 1e6),
    _fixed('reference.seconds', float, 0.2, 's', 'untouched time at the start that is taken for the reference', 0.001, 60.0),
    _fixed('reference.fastest_drift', float, 0.1, 'V/s', 'of the sum of the outputs, which is followed while nothing touches', 1e-4, 100.0),
    _fixed('paper.threshold', float, 0.2, 'V', 'paper: sum of the outputs above which something touches', 1e-4, 100.0),
)
