# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The touchpad's launch file plus numbers in the terminal, pictures and a video; ends by itself."""
from launch import LaunchDescription
from launch.actions import OpaqueFunction

from tactile_bringup.launch.arguments import sensor_arguments
from tactile_bringup.launch.demo import SENSOR_TYPE, demo_actions, demo_arguments


def generate_launch_description():
    """The arguments and the nodes that they make."""
    return LaunchDescription([*sensor_arguments(SENSOR_TYPE), *demo_arguments(), OpaqueFunction(function=demo_actions)])
