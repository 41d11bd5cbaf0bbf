# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of taxel_contact_node: the array and its pad, contact estimation, and what is known of the grasped object."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from tactile_driver.parameters.table import Parameter

from ..common.geometry import FrameTree
from ..core.errors import BadArgument
from .estimator import TAXEL_METHODS, TaxelEstimator, TaxelSettings
from .pressure import MAX_SIZE, SoftPad, TaxelArray
from .response import SENSOR, Response, read_taxels
from .wrench import GraspedObject

_fixed = partial(Parameter, read_only=True)
_HERE = np.eye(3), np.zeros(3)

TAXEL_SENSOR_PARAMETERS = (
    _fixed('sensor_type', str, SENSOR, '', 'sensor type; a calibration file must be for the same type', choices=(SENSOR,)),
    _fixed('rows', int, 44, '', 'rows of taxels: the height of the image', 1, MAX_SIZE),
    _fixed('columns', int, 44, '', 'columns of taxels: the width of the image', 1, MAX_SIZE),
    _fixed('pitch', float, 0.001, 'm', 'distance between taxels along rows and columns', 1e-5, 0.1),
    _fixed('bits', int, 0, '', 'bits of a value: full scale is 2^bits - 1; 0: not known, a largest value of an image that is 2^8 - 1 to '
           '2^16 - 1 is full scale', choices=(0, *range(8, 17))),
    _fixed('dead_taxels', list[int], [-1], '', 'indices (row * columns + column) of dead taxels; -1: none', -1, MAX_SIZE**2),
    _fixed('pad.thickness', float, 0.002, 'm', 'thickness of the soft pad', 1e-5, 0.1),
    _fixed('pad.stiffness', float, 3e5, 'Pa', 'pressure under a wide flat plate, divided by depth / thickness', 1.0, 1e9),
    _fixed('pad.shear_modulus', float, 1e5, 'Pa', 'shear modulus of the pad', 1.0, 1e9),
    _fixed('pad.friction', float, 0.6, '', 'friction coefficient between pad and object', 0.01, 10.0),
    _fixed('calibration', str, '', '', 'calibration file from calibrate; empty: pressure and force are NaN'),
)

OBJECT_PARAMETERS = (
    Parameter('object.depth', float, -1.0, 'm',
              'indentation depth of the object; negative: not known. Gives the force where pressure does not', -1.0, 0.1),
    Parameter('object.width', float, 0.0, 'm',
              'width of the object between the fingers, which gives the depth with gripper.joint; 0: not known', 0.0, 10.0),
    Parameter('object.can_roll', bool, True, '', 'whether the object can roll over the pad; false: two parallel fingers hold it'),
    Parameter('object.weight', float, 0.0, 'N',
              'weight of the object between two fingers; 0: not known, friction forces are NaN', 0.0, 1e4),
    Parameter('object.gravity', list[float], [0.0, 1.0, 0.0], '', 'direction of gravity', -1.0, 1.0),
    _fixed('object.gravity_frame', str, '', '', 'tf frame in which gravity is given; empty: the sensor frame'),
    Parameter('object.centre_of_mass', list[float], [0.0, 0.0, 0.0], 'm', 'centre of mass of the object', -10.0, 10.0),
    _fixed('object.centre_of_mass_frame', str, '', '', 'tf frame in which the centre of mass is given; empty: the sensor frame'),
)

GRIPPER_PARAMETERS = (
    _fixed('gripper.joint', str, '', '', 'joint of /joint_states that moves the fingers; empty: none, object.depth is the depth'),
    _fixed('gripper.sign', float, 1.0, 'm',
           'by how much one unit of the joint widens the gap between the pads: 1, -1, or 2 where each finger moves by it', -1e3, 1e3),
    _fixed('gripper.zero', float, 0.0, '', 'position of the joint where the untouched pads just meet', -1e6, 1e6),
    _fixed('wrench_frame', str, '', '', 'tf frame, such as that of a force/torque sensor, at whose origin and along whose axes wrench is '
           'published; empty: the sensor frame'),
)

TAXEL_PARAMETERS = TAXEL_SENSOR_PARAMETERS + (
    _fixed('method', str, 'mechanics', '', 'estimation method; mechanics: mechanics of the pad; paper: the steps of the paper',
           choices=TAXEL_METHODS),
    _fixed('reference.start', str, 'auto', '',
           'untouched values at the start; first: the first frame; zero: zeros, where something may touch already; auto: zeros if most '
           'values of the first frame are 0, else that frame; those of a calibration have precedence', choices=('auto', 'first', 'zero')),
    _fixed('reference.frames', int, 10, '', 'untouched frames averaged for the reference', 1, 1000),
    _fixed('reference.time_constant', float, 30.0, 's',
           'time constant with which the reference follows drift while nothing touches', 0.1, 1e6),
) + OBJECT_PARAMETERS + GRIPPER_PARAMETERS


def taxel_array(values: Mapping) -> TaxelArray:
    """Make the array that values (of TAXEL_SENSOR_PARAMETERS) describe."""
    return TaxelArray(values['rows'], values['columns'], values['pitch'], 2.0**values['bits'] - 1 if values['bits'] else np.inf)


def taxel_estimator(values: Mapping) -> TaxelEstimator:
    """Make the estimator that values (of TAXEL_PARAMETERS) describe. Raises BadArgument or BadCalibration for inconsistent values."""
    array = taxel_array(values)
    pad = SoftPad(*(values[f'pad.{name}'] for name in ('thickness', 'stiffness', 'shear_modulus', 'friction')))
    response = read_taxels(values['calibration'], array, values) if values['calibration'] else Response()
    if response.zero is None and values['reference.start'] == 'zero':
        response = replace(response, zero=np.zeros(array.shape, np.float32))
    dead = tuple(number for number in values['dead_taxels'] if number >= 0)
    estimator = TaxelEstimator(array, pad, TaxelSettings(values['method'], dead, values['reference.frames'],
                                                         values['reference.time_constant'], response, values['reference.start'] == 'auto'))
    estimator.grasped = grasped_object(values)
    return estimator


def frames_of(values: Mapping) -> set[str]:
    """Collect the tf frames that values (of OBJECT_PARAMETERS) name."""
    return {values[name] for name in ('object.gravity_frame', 'object.centre_of_mass_frame')} - {''}


def contact_depth(values: Mapping, position: float) -> float:
    """Depth z_c of eq 5, m, of a gripper whose joint is at a position: half of the object's width minus the gap between the pads.

    It is negative if the gap is wider, and NaN without the object's width. values: of GRIPPER_PARAMETERS and OBJECT_PARAMETERS.
    """
    if not values['object.width'] > 0:
        return np.nan
    gap = values['gripper.sign'] * (position - values['gripper.zero'])
    return 0.5 * (values['object.width'] - gap)


def grasped_object(values: Mapping, tree: FrameTree = FrameTree(), sensor_frame: str = '') -> GraspedObject:
    """Make the grasped object, in the sensor frame, from values (of OBJECT_PARAMETERS).

    Quantities given in a frame that tree does not connect to sensor_frame are NaN. Raises BadArgument for a gravity or a centre of mass
    without three numbers, and for a gravity of 0.
    """
    gravity, mass = (np.array(values[f'object.{name}'], float) for name in ('gravity', 'centre_of_mass'))
    if gravity.shape != (3,) or mass.shape != (3,) or not np.linalg.norm(gravity) > 0:
        raise BadArgument('parameters object.gravity and object.centre_of_mass must have three numbers each, and gravity a direction')
    poses = {name: tree.pose(name, sensor_frame) for name in frames_of(values)} | {'': _HERE}
    if None in poses.values():
        return GraspedObject(_depth(values), can_roll=values['object.can_roll'])
    rotation, _ = poses[values['object.gravity_frame']]
    rotation_of_centre, origin = poses[values['object.centre_of_mass_frame']]
    weight = values['object.weight']
    held = rotation @ gravity * (weight / np.linalg.norm(gravity)) if weight > 0 else np.full(3, np.nan)
    return GraspedObject(_depth(values), held, rotation_of_centre @ mass + origin, values['object.can_roll'])


def _depth(values: Mapping) -> float:
    return values['object.depth'] if values['object.depth'] >= 0 else np.nan
