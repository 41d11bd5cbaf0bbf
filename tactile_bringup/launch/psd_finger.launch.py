# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A PSD finger: driver, perception, markers; RViz and a recording where asked for."""
from functools import partial

from launch import LaunchDescription
from launch.actions import OpaqueFunction

from tactile_bringup.sensor_launch import sensor_arguments
from tactile_bringup.serial_launch import PSD_FINGER, serial_actions


def generate_launch_description():
    """The arguments and the nodes that they make."""
    actions = OpaqueFunction(function=partial(serial_actions, sensor=PSD_FINGER))
    return LaunchDescription([*sensor_arguments(PSD_FINGER.type), actions])
