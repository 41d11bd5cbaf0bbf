# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Several sensors at once, as a YAML file lists them: drivers, perception, markers, frames; RViz and recordings where asked for."""
from launch import LaunchDescription
from launch.actions import OpaqueFunction

from tactile_bringup.launch.hand import hand_actions, hand_arguments


def generate_launch_description():
    """The arguments and the nodes that they make."""
    return LaunchDescription([*hand_arguments(), OpaqueFunction(function=hand_actions)])
