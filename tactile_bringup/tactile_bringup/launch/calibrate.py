# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A sensor and the node that leads through its calibration."""
from __future__ import annotations

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch_ros.actions import Node
from tactile_driver.frame_names import sensor_frame
from tactile_perception.sensors import SENSOR_TYPES

from ..installed import share
from .arguments import LaunchError, check_choice, sensor_actions, sensor_arguments, values_of

#: Guided are sheets over one camera.
TYPES = tuple(name for name, row in SENSOR_TYPES.items() if row.markers and min(row.markers.size) > 0 and row.markers.cameras == 1)
_OWN = {
    'type': (TYPES[0], f'sensor type: {", ".join(TYPES)}'),
    'probe': ('', "frame of /tf at the probe's tip"),
    'wrench': ('', 'topic of a force/torque sensor (WrenchStamped), in any frame of /tf; empty: no forces'),
    'output': ('calibration.yaml', 'calibration file to write; presses are kept beside it, and an interrupted session goes on'),
    'mounting': ('', 'x y z, m, and rotation vector, rad, of the sensor in the frame base; empty: /tf has the sensor frame'),
    'base': ('base_link', 'frame of /tf in which mounting is'),
    'simulated_stage': ('false', 'true: a simulated stage moves a simulated sensor; its probe:=stage_tip, wrench:=/stage/wrench'),
}


def calibrate_description() -> LaunchDescription:
    """The launch file: the arguments of the sensor's own and those of the session."""
    own = [DeclareLaunchArgument(name, default_value=default, description=text) for name, (default, text) in _OWN.items()]
    return LaunchDescription([*own, *sensor_arguments(TYPES[0]), OpaqueFunction(function=_actions, args=[own])])


def _actions(context: LaunchContext, own: list[DeclareLaunchArgument]) -> list:
    values = values_of(context, [*own, *sensor_arguments(TYPES[0])])
    check_choice('type', values['type'], TYPES)
    check_choice('simulated_stage', values['simulated_stage'], ('true', 'false'))
    suffix = '_sim' if values['source'] == 'sim' else ''
    given = {'probe': values['probe'], 'wrench': values['wrench'], 'base': values['base'], 'frame_id': sensor_frame(values['namespace']),
             'params': values['params'] or share('params', f'{values["type"]}{suffix}.yaml'),
             'output': str(Path(values['output']).expanduser().absolute()), 'mounting': _numbers(values['mounting'])}
    if not given['probe']:
        raise LaunchError("probe:= is empty: name the frame of /tf at the probe's tip")
    if not given['mounting']:
        del given['mounting']  # launch cannot tell the type of an empty list
    guide = Node(package='tactile_bringup', executable='calibrate_node', namespace=values['namespace'], output='screen',
                 output_format='{line}', parameters=[given], on_exit=Shutdown(reason='the calibration is over'))
    stage = [Node(package='tactile_bringup', executable='simulated_stage', namespace=values['namespace'])]
    return [*sensor_actions(context, values['type'], own), guide, *(stage if values['simulated_stage'] == 'true' else [])]


def _numbers(text: str) -> list[float]:
    try:
        found = [float(word) for word in text.split()]
    except ValueError:
        found = [0.0]
    if len(found) not in (0, 6):
        raise LaunchError(f'mounting:={text} is not x y z, m, and a rotation vector, rad')
    return found
