# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A sensor and the node that guides its calibration."""
from __future__ import annotations

from launch import LaunchDescription
from launch.actions import Shutdown
from launch_ros.actions import Node

from tactile_driver.errors import BadArgument
from tactile_driver.frame_names import sensor_frame
from tactile_perception.core.sensor_type import SENSOR_TYPES

from ..sensor_files import parameter_file
from .arguments import absolute, check_choices, description, sensor_actions, sensor_arguments

_OWN = {
    'type': ('areal_single', f'sensor type: {", ".join(SENSOR_TYPES)}'),
    'probe': ('', "frame of /tf at the probe's tip; an array needs none"),
    'tip_radius': ('', "m, of the probe's round tip; a touchpad and a dome need it"),
    'wrench': ('', 'topic of a force/torque sensor (WrenchStamped), in any frame of /tf; empty: no forces'),
    'weights': ('', 'array or gel: known weights, N, in the order in which they are laid on, as "5 10 20 10 5 0"; empty: use wrench'),
    'holes': ('', 'no robot: x y of each hole of a guide plate, m, in the order in which they are pressed; no probe then'),
    'collars': ('', 'with holes: depths that the collars of the tool allow, m; all holes are pressed with each'),
    'output': ('calibration.yaml', 'calibration file to write; presses are kept beside it, and an interrupted session continues'),
    'mounting': ('', 'x y z, m, and rotation vector, rad, of the sensor in the frame base; empty: it is on /tf'),
    'find': ('false', 'true: mounting is known by hand only, to about 1 cm and 0.1 rad; twelve touches find the sensor first'),
    'base': ('base_link', 'frame of /tf in which mounting is'),
    'simulated_stage': ('false', 'true: a simulated stage moves a simulated sensor; its probe:=stage_tip, wrench:=/stage/wrench'),
}


def calibrate_description() -> LaunchDescription:
    """The launch file: the arguments of the session, and those of all sensor types, each once."""
    texts = {name: text for kind in (*SENSOR_TYPES, _OWN['type'][0]) for name, text in sensor_arguments(kind).items()}
    return description(_OWN | texts, _actions)


def _actions(values: dict[str, str]) -> list:
    check_choices(values, {'type': tuple(SENSOR_TYPES), 'simulated_stage': ('true', 'false'), 'find': ('true', 'false')})
    kind = SENSOR_TYPES[values['type']]
    given = {'probe': values['probe'], 'wrench': values['wrench'], 'base': values['base'], 'frame_id': sensor_frame(values['namespace']),
             'params': values['params'] or parameter_file(values['type'], values['source'] == 'sim'),
             'output': absolute(values['output']),
             'find': values['find'] == 'true', 'mounting': _numbers(values, 'mounting', (0, 6)),
             **{name: _numbers(values, name) for name in ('weights', 'holes', 'collars')}}
    if not (given['probe'] or given['holes'] or kind.loaded):
        raise BadArgument("probe:= is empty: name the frame of /tf at the probe's tip, or give the holes of a guide plate")
    given = {name: value for name, value in given.items() if value != []}  # launch does not know the type of an empty list
    given.update({'tip_radius': radius for radius in _numbers(values, 'tip_radius', (0, 1))})
    guide = Node(package='tactile_bringup', executable='calibrate_node', namespace=values['namespace'], output='screen',
                 output_format='{line}', parameters=[given], on_exit=Shutdown(reason='the calibration is over'))
    stage = [Node(package='tactile_bringup', executable='simulated_stage', namespace=values['namespace'],
                  parameters=[{'along_normal': values['type'] == 'psd_finger'}])]
    return [*sensor_actions(values, values['type']), guide, *(stage if values['simulated_stage'] == 'true' else [])]


def _numbers(values: dict[str, str], name: str, counts: tuple[int, ...] = ()) -> list[float]:
    """The numbers of an argument. Raises BadArgument for words, and for another count than these."""
    try:
        found = [float(word) for word in values[name].split()]
    except ValueError:
        raise BadArgument(f'{name}:={values[name]} has a word that is not a number') from None
    if counts and len(found) not in counts:
        raise BadArgument(f'{name}:={values[name]} has {len(found)} numbers; give {counts[-1]}')
    return found
