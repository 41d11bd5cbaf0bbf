# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The finger's parameters, all fixed at start, and its contact methods by name."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from tactile_driver.parameters.table import Parameter
from tactile_driver.plugins import PluginTable

from .._core import finger
from ..core.errors import by_name
from .model import FingerModel

PsdFinger, FingerSettings = finger.PsdFinger, finger.FingerSettings


def finger_settings(values: Mapping) -> dict:
    """Make the settings of a finger from the parameters of its node.

    Parameters
    ----------
    values : Mapping
        Values of PSD_PARAMETERS.

    Returns
    -------
    dict
        Arguments of FingerSettings.
    """
    return {'radius': values['radius'], 'saturation': values['saturation'], 'reference_seconds': values['reference.seconds'],
            'fastest_drift': values['reference.fastest_drift'], 'each_sample': values['results'] == 'sample'}


#: Name -> makes a finger of a model and the values of PSD_PARAMETERS.
PSD_METHODS: Mapping[str, Callable[[FingerModel, Mapping], PsdFinger]] = PluginTable('tactile_perception.finger_methods', {
    'map': lambda model, values: PsdFinger(model, FingerSettings(**finger_settings(values))),
    'paper': 'tactile_perception.published.psd_finger:make_finger',
})

_fixed = partial(Parameter, read_only=True)

PSD_SENSOR_PARAMETERS = (
    _fixed('sensor_type', str, 'psd_finger', '', 'sensor type; a calibration file must be for the same type', choices=('psd_finger',)),
    _fixed('radius', float, 0.016, 'm', "outer radius of the hemisphere", 1e-4, 1.0),
    _fixed('saturation', float, 4.9, 'V', 'output voltage at which an output saturates', 1e-3, 1e3),
    _fixed('calibration', str, '', '', 'calibration file from calibrate; empty: nominal values'),
)

PSD_PARAMETERS = PSD_SENSOR_PARAMETERS + (
    _fixed('method', str, 'map', '', 'contact estimation method; map: the calibrated map; paper: offset, factor and threshold of the paper',
           choices=PSD_METHODS),
    _fixed('results', str, 'batch', '',
           'batch: one result a message and one at each begin and end of a contact; sample: one result a sample',
           choices=('batch', 'sample')),
    _fixed('reference.seconds', float, 0.2, 's', 'untouched time at the start, averaged for the reference', 0.001, 60.0),
    _fixed('reference.fastest_drift', float, 0.1, 'V/s',
           'fastest drift of the sum of the outputs that the reference follows while nothing touches', 1e-4, 100.0),
    _fixed('paper.threshold', float, 0.2, 'V', 'paper: sum of the outputs above which something touches', 1e-4, 100.0),
)


def make_finger(model: FingerModel, values: Mapping) -> PsdFinger:
    """Make a finger that turns batches of voltages into contacts.

    Parameters
    ----------
    model : FingerModel
        Calibrated model.
    values : Mapping
        Values of PSD_PARAMETERS; ``method`` names the method.

    Returns
    -------
    PsdFinger

    Raises
    ------
    BadArgument
        If the method is unknown; the message lists the known ones.
    """
    return by_name(PSD_METHODS, values['method'], 'method')(model, values)
