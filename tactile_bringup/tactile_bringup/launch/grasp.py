# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated gripper, the drivers and perception of its array and its touchpad, and the controller that holds by them."""
from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import yaml
from launch import LaunchDescription
from launch.actions import RegisterEventHandler
from launch.event_handlers import OnProcessIO
from launch.events.process import ProcessIO
from launch.logging import launch_config
from launch_ros.actions import Node

from tactile_driver.errors import BadArgument

from ..grasp.objects import ARRAY_PARAMETERS, FLAT_PAD, OBJECTS, PADS, READY, HeldObject, closing_width
from ..sensor_files import parameter_file, simulated_calibration
from .arguments import VIEW, Texts, check_choices, description, end_if_wrong, hand_node, number, sensor_actions, sensor_arguments, written
from .grasp_control import RosControl, ros2_control

_ARRAY, _TOUCHPAD, _BOOLEANS = 'array', 'touchpad', ('true', 'false')
_SIMULATED_TIME = {'use_sim_time': True}  # /clock of gripper_node


def grasp_description() -> LaunchDescription:
    """The launch file."""
    return description(grasp_arguments(), grasp_actions)


def grasp_arguments() -> Texts:
    """The arguments of grasp.launch.py."""
    return {'object': ('box', 'what stands between the fingers: ' + ', '.join(OBJECTS)),
            'pad': (FLAT_PAD, 'sensor of the left finger: a pressure array, or taxels that measure forces; ' + ', '.join(PADS)),
            'demo': ('false', 'true: grasp and lift the object at once; false: wait for the services ~/grasp and ~/lift'),
            'touchpad': ('true', 'whether the right finger has a touchpad; false: the array alone, which takes half the processor'),
            'ros2_control': ('false', 'true: mujoco_ros2_control simulates the gripper and a controller of ros2_controllers moves it; '
                             'false: gripper_node does both'),
            'speed': ('1.0', 'simulated time in a second of real time: 0.3 for instance where the machine is too slow'),
            'rviz': ('false', 'show the array in RViz: true or false'),
            **VIEW,
            'record': ('', 'bag (MCAP) of the array to write; empty: none')}


def grasp_actions(values: dict[str, str]) -> list:
    """The actions for the values of the arguments. Raises BadArgument."""
    check_choices(values, {'object': tuple(OBJECTS), 'pad': tuple(PADS),
                           **dict.fromkeys(('rviz', 'demo', 'touchpad', 'ros2_control', *VIEW), _BOOLEANS)})
    if find_spec('mujoco') is None:
        raise BadArgument('the simulated gripper needs MuJoCo, an optional extra: pip install mujoco')
    held, is_controlled = OBJECTS[values['object']], values['ros2_control'] == 'true'
    port = str(Path(launch_config.log_dir, 'array_port'))
    sensor_type = PADS[values['pad']]
    array = {name: default for name, (default, _) in sensor_arguments(sensor_type).items()} | {
        'namespace': _ARRAY, 'source': 'device', 'device': port, 'record': values['record'],
        **_settings(sensor_type), **{name: values[name] for name in ('rviz', *VIEW)}}
    demo, has_touchpad = values['demo'] == 'true', values['touchpad'] == 'true'
    own = {'package': 'tactile_bringup', 'output': 'screen', 'on_exit': end_if_wrong}
    control = ros2_control(held, values['pad'], number(values, 'speed')) if is_controlled else RosControl()
    gripper = Node(executable='gripper_follower' if is_controlled else 'gripper_node', **own,
                   parameters=[{'object': values['object'], 'pad': values['pad'], 'port': port, 'lift': demo,
                               'speed': number(values, 'speed')}])
    frames = hand_node(written('gripper.urdf', _description(held, sensor_type, has_touchpad, control.elements)), **_SIMULATED_TIME)
    others = [*sensor_actions(array, sensor_type), *(sensor_actions(_touchpad(), _TOUCHPAD) if has_touchpad else []),
              Node(executable='grip_controller', **own, remappings=control.remappings,
                   parameters=[_SIMULATED_TIME, {'sensor': _ARRAY, 'shear_sensor': _TOUCHPAD if has_touchpad else '', 'grasp': demo,
                                                 **control.grip_parameters}])]
    starts_others = OnProcessIO(target_action=gripper, on_stderr=partial(_when_ready, others))
    return [gripper, frames, *control.nodes, RegisterEventHandler(starts_others)]


def _settings(sensor_type: str) -> dict[str, str]:
    """The arguments of the left finger's sensor."""
    if sensor_type == 'taxel_array':
        return {'params': _params(sensor_type, ARRAY_PARAMETERS | _SIMULATED_TIME), 'calibration': simulated_calibration(sensor_type)}
    from ..grasp.force_pad import layout  # takes a second

    return {'params': _params(sensor_type, {'force_unit': 1.0} | _SIMULATED_TIME), 'layout': written('gripper_layout.yaml', layout())}


def _touchpad() -> dict[str, str]:
    """The arguments of the touchpad, whose skin is stiffer than that of the simulated one, and whose process may be started again while it
    holds an object."""
    from ..grasp.skin import PARAMETERS  # takes a second

    return {name: default for name, (default, _) in sensor_arguments(_TOUCHPAD).items()} | {
        'namespace': _TOUCHPAD, 'source': 'topics', 'topic': '/gripper_node/touchpad/image_raw',
        'params': _params(_TOUCHPAD, PARAMETERS | _SIMULATED_TIME | {
            'reference_file': str(Path(launch_config.log_dir, 'touchpad_reference.npy'))})}


def _params(sensor_type: str, others: Mapping[str, object]) -> str:
    """The path of the parameter file of a simulated sensor, with other parameters."""
    page = yaml.safe_load(Path(parameter_file(sensor_type, True)).read_text())
    page['/**']['ros__parameters'] |= others
    return written(f'{sensor_type}_gripper.yaml', yaml.safe_dump(page))


def _description(held: HeldObject, sensor_type: str, has_touchpad: bool, others: str) -> str:
    """The URDF of the gripper: of its links, joints and sensors, not of its shape; others: further elements of it."""
    from ..grasp.skin import APEX

    apart, fingers, sensors = closing_width(held), [], [(_ARRAY, sensor_type, 'left', 0.0)]
    if has_touchpad:
        sensors.append((_TOUCHPAD, 'touchpad', 'right', -APEX))
    for side, sign, mimic in (('left', -1, ''), ('right', 1, '<mimic joint="left_finger_joint"/>')):
        fingers.append(f'<link name="{side}_finger"/><joint name="{side}_finger_joint" type="prismatic"><parent link="hand"/>'
                       f'<child link="{side}_finger"/><origin xyz="{sign * apart} 0 0" rpy="{math.pi / 2} 0 {-sign * math.pi / 2}"/>'
                       f'<axis xyz="0 0 1"/><limit lower="-0.02" upper="{apart}" effort="40" velocity="0.1"/>{mimic}</joint>')
    mounted = [f'<link name="{name}"/><joint name="{name}_mounting" type="fixed"><parent link="{side}_finger"/><child link="{name}"/>'
               f'<origin xyz="0 0 {height}"/></joint><tactile_sensor name="{name}" type="{kind}" link="{name}"/>'
               for name, kind, side, height in sensors]
    return '\n'.join(['<robot name="gripper"><link name="hand"/>', *fingers, *mounted, others, '</robot>'])


def _when_ready(others: list, event: ProcessIO) -> list:
    """The other processes, once the gripper has said that its array sends: before that a driver finds no port."""
    started = others[:] if READY.encode() in event.text else []
    del others[:len(started)]
    return started
