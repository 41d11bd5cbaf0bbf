# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A sensor's launch file plus numbers in the terminal, pictures and a video; ends by itself."""
from launch import LaunchDescription
from launch.actions import OpaqueFunction

from tactile_bringup.launch.demo import demo_actions, demo_arguments


def generate_launch_description():
    """The arguments and the nodes that they make."""
    return LaunchDescription([*demo_arguments(), OpaqueFunction(function=demo_actions)])
