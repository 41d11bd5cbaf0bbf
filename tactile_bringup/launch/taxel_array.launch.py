# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A taxel array behind a soft pad: driver, perception, markers; RViz and a recording where asked for."""
from functools import partial

from launch import LaunchDescription
from launch.actions import OpaqueFunction

from tactile_bringup.sensor_launch import sensor_arguments
from tactile_bringup.serial_launch import TAXEL_ARRAY, serial_actions


def generate_launch_description():
    """The arguments and the nodes that they make."""
    actions = OpaqueFunction(function=partial(serial_actions, sensor=TAXEL_ARRAY))
    return LaunchDescription([*sensor_arguments(TAXEL_ARRAY.type), actions])
