# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated gripper under ros2_control: mujoco_ros2_control simulates it, ros2_controllers move it."""
from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch import LaunchContext
from launch.events.process import ProcessExited
from launch_ros.actions import Node

from tactile_driver.errors import BadArgument

from ..grasp.followed_world import FINGER_JOINT, JOINTS, LIFT_JOINT, OBJECT_SENSOR, simulator_text
from ..grasp.objects import HeldObject, closing_width
from .arguments import end_if_wrong, written

#: Package -> its apt package without the prefix ros-jazzy-.
_PACKAGES = {'mujoco_ros2_control': 'mujoco-ros2-control', 'controller_manager': 'controller-manager',
            **{name: 'ros2-controllers' for name in ('gripper_controllers', 'joint_state_broadcaster', 'joint_trajectory_controller',
                                                     'pose_broadcaster')}}
_CONTROLLERS = {'joint_state_broadcaster': 'joint_state_broadcaster/JointStateBroadcaster',
                'object_pose_broadcaster': 'pose_broadcaster/PoseBroadcaster',
                'gripper_controller': 'effort_controllers/GripperActionController',
                'lift_controller': 'joint_trajectory_controller/JointTrajectoryController'}
_RATE = 100  # Hz of the controllers: a frame of the array each; a period must be whole steps of the engine
_STIFFNESS = 1000.0  # N/m of the gripper's controller: the force is limited, so that this acts only near the goal
_MAX_FORCE = 40.0  # N, of each finger
#: The force of the controller is its limit where the goal is farther away than this, m.
_BEYOND = _MAX_FORCE / _STIFFNESS


@dataclass(frozen=True)
class RosControl:
    """What ros2_control adds to the launch; nothing without it.

    nodes: the simulator with its controllers, and what starts these; elements: of the gripper's URDF; remappings, grip_parameters: of
    grip_controller.
    """

    nodes: Sequence[Node] = ()
    elements: str = ''
    remappings: Sequence[tuple[str, str]] = ()
    grip_parameters: Mapping[str, float] = field(default_factory=dict)


def ros2_control(held: HeldObject, pad: str, speed: float) -> RosControl:
    """For an object, the pad of the left finger, and the simulated time in a second of real time. Raises BadArgument, which names what to
    install, where a package is missing."""
    _check_packages()
    file = written('gripper_controllers.yaml', _controllers())
    nodes = [Node(package='mujoco_ros2_control', executable='ros2_control_node', parameters=[{'use_sim_time': True}, file], output='screen',
                  ros_arguments=['--log-level', 'gripper_controller:=warn'],  # which else writes a line for each goal
                  on_exit=_end_without_simulator),
             Node(package='controller_manager', executable='spawner', arguments=[*_CONTROLLERS, '--param-file', file], output='screen',
                  on_exit=end_if_wrong)]
    model = written('gripper.xml', simulator_text(held, pad))
    return RosControl(nodes, _elements(model, speed), [('gripper_cmd', '/gripper_controller/gripper_cmd')],
                      {'closed_position': closing_width(held) + _BEYOND, 'open_position': 0.0})


def _end_without_simulator(event: ProcessExited, context: LaunchContext) -> None:
    """Raises BadArgument, with which launch fails, when the simulator has died."""
    if not context.is_shutdown:
        raise BadArgument(f'{event.process_name}: the simulator ended with exit code {event.returncode}, see its messages above')


def _check_packages() -> None:
    missing = []
    for package, name in _PACKAGES.items():
        try:
            get_package_prefix(package)
        except PackageNotFoundError:
            missing.append(f'ros-jazzy-{name}')
    if missing:
        raise BadArgument(f'ros2_control:=true needs packages that are not installed: sudo apt install {" ".join(dict.fromkeys(missing))}')


def _elements(model: str, speed: float) -> str:
    """The table, from which the wrist rises, and the tag for ros2_control; model: path of the MJCF."""
    states = ''.join(f'<state_interface name="{name}"/>' for name in ('position', 'velocity', 'effort'))
    commands = {LIFT_JOINT: '<command_interface name="position"/>', FINGER_JOINT: '<command_interface name="effort"/>'}
    joints = ''.join(f'<joint name="{name}">{commands.get(name, "")}{states}</joint>' for name in JOINTS)
    pose = ''.join(f'<state_interface name="{name}"/>' for name in (*(f'position.{axis}' for axis in 'xyz'),
                                                                    *(f'orientation.{axis}' for axis in 'xyzw')))
    return (f'<link name="table"/><joint name="{LIFT_JOINT}" type="prismatic"><parent link="hand"/><child link="table"/>'
            '<axis xyz="0 0 -1"/><limit lower="-0.01" upper="0.5" effort="1000" velocity="1"/></joint>'
            '<ros2_control name="gripper" type="system"><hardware><plugin>mujoco_ros2_control/MujocoSystemInterface</plugin>'
            f'<param name="mujoco_model">{model}</param><param name="headless">true</param><param name="sim_speed_factor">{speed}</param>'
            f'</hardware>{joints}<sensor name="{OBJECT_SENSOR}"><param name="mujoco_type">pose</param>'
            f'<param name="mujoco_sensor_name">{OBJECT_SENSOR}</param>{pose}</sensor></ros2_control>')


def _controllers() -> str:
    """The parameter file of controller_manager and its controllers."""
    parameters = {'controller_manager': {'update_rate': _RATE, 'use_sim_time': True,
                                         **{name: {'type': kind} for name, kind in _CONTROLLERS.items()}},
                  'object_pose_broadcaster': {'pose_name': OBJECT_SENSOR, 'frame_id': 'hand', 'tf': {'enable': False}},
                  'gripper_controller': {'joint': FINGER_JOINT, 'allow_stalling': True, 'max_effort': _MAX_FORCE,
                                         'gains': {FINGER_JOINT: {'p': _STIFFNESS, 'i': 0.0, 'd': 0.0}}},
                  'lift_controller': {'joints': [LIFT_JOINT], 'command_interfaces': ['position'],
                                      'state_interfaces': ['position', 'velocity']}}
    return json.dumps({name: {'ros__parameters': own} for name, own in parameters.items()}, indent=2)
