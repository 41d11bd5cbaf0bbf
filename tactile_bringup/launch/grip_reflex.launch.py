# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A grip reflex on a simulated sensor: on the taxel array in a simulated gripper, whose object it holds; on the touchpad, whose scene goes
on as it is whatever the command."""
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import EqualsSubstitution, LaunchConfiguration
from launch_ros.actions import Node

SENSORS = ('taxel_array', 'touchpad')


def generate_launch_description():
    """The arguments and the nodes that they make."""
    share = Path(get_package_share_directory('tactile_bringup'))
    array, pad = (IfCondition(EqualsSubstitution(LaunchConfiguration('sensor'), sensor)) for sensor in SENSORS)
    known = [str(share / 'params' / 'taxel_array_sim.yaml'), {'calibration': str(share / 'calibration' / 'taxel_array_sim.yaml')}]
    touchpad = IncludeLaunchDescription(PythonLaunchDescriptionSource(str(share / 'launch' / 'touchpad.launch.py')),
                                        launch_arguments={'scene': 'rectangle_drag'}.items(), condition=pad)
    return LaunchDescription([
        DeclareLaunchArgument('sensor', default_value=SENSORS[0], choices=SENSORS, description='simulated sensor, and its namespace'),
        Node(package='tactile_bringup', executable='simulated_gripper', namespace=SENSORS[0], condition=array),
        Node(package='tactile_perception', executable='taxel_contact_node', namespace=SENSORS[0], parameters=known, condition=array),
        touchpad,
        Node(package='tactile_bringup', executable='grip_reflex', namespace=LaunchConfiguration('sensor'), output='screen'),
    ])
