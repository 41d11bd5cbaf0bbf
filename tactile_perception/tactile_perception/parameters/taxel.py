# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of taxel_contact_node: what the array and its pad are, how contact is told, and what is known of the grasped object."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from tactile_driver.parameters.table import Parameter

from ..calibration.files.taxel import SENSOR, read_taxels
from ..common.frame_tree import FrameTree
from ..errors import BadArgument
from ..taxel.array import LARGEST, SoftPad, TaxelArray
from ..taxel.estimator import TAXEL_METHODS, TaxelEstimator, TaxelSettings
from ..taxel.response import Response
from ..taxel.wrench import GraspedObject

_fixed = partial(Parameter, read_only=True)
_HERE = np.eye(3), np.zeros(3)

TAXEL_SENSOR_PARAMETERS = (
    _fixed('sensor_type', str, SENSOR, '', 'kind of sensor; a calibration file has to be for the same', choices=(SENSOR,)),
    _fixed('rows', int, 44, '', 'of taxels; a row of the image each', 1, LARGEST),
    _fixed('columns', int, 44, '', 'of taxels', 1, LARGEST),
    _fixed('pitch', float, 0.001, 'm', 'from taxel to taxel, along rows and columns', 1e-5, 0.1),
    _fixed('bits', int, 8, '', 'of a value: the largest is 2^bits - 1', 8, 16),
    _fixed('dead_taxels', list[int], [-1], '', 'numbers (row * columns + column) of taxels known to be dead; -1: none', -1, LARGEST**2),
    _fixed('pad.thickness', float, 0.002, 'm', 'of the soft pad', 1e-5, 0.1),
    _fixed('pad.stiffness', float, 3e5, 'Pa', 'pressure under a wide flat plate over depth / thickness', 1.0, 1e9),
    _fixed('pad.shear_modulus', float, 1e5, 'Pa', 'of the pad', 1.0, 1e9),
    _fixed('pad.friction', float, 0.6, '', 'coefficient between pad and object', 0.01, 10.0),
    _fixed('calibration', str, '', '', 'calibration file from calibrate; empty: pressure and force are not known'),
)

OBJECT_PARAMETERS = (
    Parameter('object.depth', float, -1.0, 'm', 'by which the object stands in the pad; negative: not known, force by pressure', -1.0, 0.1),
    Parameter('object.weight', float, 0.0, 'N', 'of the object between two fingers; 0: not known, no friction is told', 0.0, 1e4),
    Parameter('object.gravity', list[float], [0.0, 1.0, 0.0], '', 'direction of gravity', -1.0, 1.0),
    _fixed('object.gravity_frame', str, '', '', 'frame of tf in which gravity is given; empty: the sensor frame'),
    Parameter('object.centre_of_mass', list[float], [0.0, 0.0, 0.0], 'm', 'of the object', -10.0, 10.0),
    _fixed('object.centre_of_mass_frame', str, '', '', 'frame of tf in which the centre of mass is given; empty: the sensor frame'),
)

TAXEL_PARAMETERS = TAXEL_SENSOR_PARAMETERS + (
    _fixed('method', str, 'mechanics', '', 'contact and slip by the mechanics of the pad, or by the steps of the paper',
           choices=tuple(TAXEL_METHODS)),
    _fixed('reference.start', str, 'first', '', 'untouched values at the start: the first frame; zero, where it may be touched already; '
           'a calibration that has them goes before', choices=('first', 'zero')),
    _fixed('reference.frames', int, 10, '', 'untouched frames that are averaged for the reference', 1, 1000),
    _fixed('reference.time_constant', float, 30.0, 's', 'how fast slow drift is followed while nothing touches', 0.1, 1e6),
) + OBJECT_PARAMETERS


def taxel_array(values: Mapping) -> TaxelArray:
    """The array that values (of TAXEL_SENSOR_PARAMETERS) describe."""
    return TaxelArray(values['rows'], values['columns'], values['pitch'], 2.0**values['bits'] - 1)


def taxel_estimator(values: Mapping) -> TaxelEstimator:
    """The estimator that values (of TAXEL_PARAMETERS) describe. Raises BadArgument, BadCalibration for what does not fit together."""
    array = taxel_array(values)
    pad = SoftPad(*(values[f'pad.{name}'] for name in ('thickness', 'stiffness', 'shear_modulus', 'friction')))
    response = read_taxels(values['calibration'], array, values) if values['calibration'] else Response()
    if response.zero is None and values['reference.start'] == 'zero':
        response = replace(response, zero=np.zeros(array.shape, np.float32))
    dead = tuple(number for number in values['dead_taxels'] if number >= 0)
    estimator = TaxelEstimator(array, pad, TaxelSettings(values['method'], dead, values['reference.frames'],
                                                         values['reference.time_constant'], response))
    estimator.grasped = grasped_object(values)
    return estimator


def frames_of(values: Mapping) -> set[str]:
    """The frames of tf by which values (of OBJECT_PARAMETERS) tell of the object."""
    return {values[name] for name in ('object.gravity_frame', 'object.centre_of_mass_frame')} - {''}


def grasped_object(values: Mapping, tree: FrameTree = FrameTree(), sensor_frame: str = '') -> GraspedObject:
    """What values (of OBJECT_PARAMETERS) tell of the object in the sensor frame; what is given in a frame whose place tree does not tell
    is not known. Raises BadArgument for a direction or place that is none."""
    gravity, mass = (np.array(values[f'object.{name}'], float) for name in ('gravity', 'centre_of_mass'))
    if gravity.shape != (3,) or mass.shape != (3,) or not np.linalg.norm(gravity) > 0:
        raise BadArgument('parameters object.gravity and object.centre_of_mass must have three numbers each, and gravity a direction')
    poses = {name: tree.pose(name, sensor_frame) for name in frames_of(values)} | {'': _HERE}
    if None in poses.values():
        return GraspedObject(_depth(values))
    rotation, _ = poses[values['object.gravity_frame']]
    turn, place = poses[values['object.centre_of_mass_frame']]
    weight = values['object.weight']
    held = rotation @ gravity * (weight / np.linalg.norm(gravity)) if weight > 0 else np.full(3, np.nan)
    return GraspedObject(_depth(values), held, turn @ mass + place)


def _depth(values: Mapping) -> float:
    return values['object.depth'] if values['object.depth'] >= 0 else np.nan
