# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A taxel array behind a soft pad: driver, perception, markers; RViz and a recording where asked for."""
from launch import LaunchDescription
from launch.actions import OpaqueFunction

from tactile_bringup.sensor_launch import sensor_arguments
from tactile_bringup.taxel_launch import SENSOR_TYPE, taxel_actions


def generate_launch_description():
    """The arguments and the nodes that they make."""
    return LaunchDescription([*sensor_arguments(SENSOR_TYPE), OpaqueFunction(function=taxel_actions)])
