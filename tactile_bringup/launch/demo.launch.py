# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The touchpad's launch file plus numbers in the terminal, pictures and a video; ends by itself."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction

from tactile_bringup.demo_launch import DEMO_ARGUMENTS, demo_actions
from tactile_bringup.sensor_launch import sensor_arguments
from tactile_bringup.touchpad_launch import SENSOR_TYPE


def generate_launch_description():
    """The arguments and the nodes that they make."""
    own = [DeclareLaunchArgument(name, default_value=default, description=text) for name, (default, text) in DEMO_ARGUMENTS.items()]
    return LaunchDescription([*sensor_arguments(SENSOR_TYPE), *own, OpaqueFunction(function=demo_actions)])
