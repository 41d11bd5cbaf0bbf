# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated gripper, the driver and perception of its array, and the controller that holds by them."""
from __future__ import annotations

from functools import partial
from importlib.util import find_spec
from pathlib import Path

from launch import LaunchDescription
from launch.actions import RegisterEventHandler
from launch.event_handlers import OnProcessIO
from launch.events.process import ProcessIO
from launch.logging import launch_config
from launch_ros.actions import Node

from tactile_driver.errors import BadArgument

from ..grasp.objects import OBJECTS, READY
from ..sensor_files import parameter_file, simulated_calibration
from .arguments import Texts, check_choices, description, end_if_wrong, sensor_actions, sensor_arguments

_ARRAY, _BOOLEANS = 'array', ('true', 'false')


def grasp_description() -> LaunchDescription:
    """The launch file."""
    return description(grasp_arguments(), grasp_actions)


def grasp_arguments() -> Texts:
    """The arguments of grasp.launch.py."""
    return {'object': ('box', 'what stands between the fingers: ' + ', '.join(OBJECTS)),
            'demo': ('false', 'true: grasp and lift the object at once; false: wait for the services ~/grasp and ~/lift'),
            'rviz': ('false', 'show the array in RViz: true or false'),
            'record': ('', 'bag (MCAP) of the array to write; empty: none')}


def grasp_actions(values: dict[str, str]) -> list:
    """The actions for the values of the arguments. Raises BadArgument."""
    check_choices(values, {'object': tuple(OBJECTS), 'rviz': _BOOLEANS, 'demo': _BOOLEANS})
    if find_spec('mujoco') is None:
        raise BadArgument('the simulated gripper needs MuJoCo, an optional extra: pip install mujoco')
    port = str(Path(launch_config.log_dir, 'array_port'))
    array = {name: default for name, (default, _) in sensor_arguments('taxel_array').items()} | {
        'namespace': _ARRAY, 'source': 'device', 'device': port, 'params': parameter_file('taxel_array', True),
        'calibration': simulated_calibration('taxel_array'), 'rviz': values['rviz'], 'record': values['record']}
    demo = values['demo'] == 'true'
    own = {'package': 'tactile_bringup', 'output': 'screen', 'on_exit': end_if_wrong}
    gripper = Node(executable='gripper_node', parameters=[{'object': values['object'], 'port': port, 'lift': demo}], **own)
    others = [*sensor_actions(array, 'taxel_array'),
              Node(executable='grip_controller', parameters=[{'sensor': _ARRAY, 'grasp': demo}], **own)]
    return [gripper, RegisterEventHandler(OnProcessIO(target_action=gripper, on_stderr=partial(_when_ready, others)))]


def _when_ready(others: list, event: ProcessIO) -> list:
    """The other processes, once the gripper has said that its array sends: before that a driver finds no port."""
    started = others[:] if READY.encode() in event.text else []
    del others[:len(started)]
    return started
