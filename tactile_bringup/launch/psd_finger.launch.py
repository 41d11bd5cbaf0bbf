# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A PSD finger: driver, perception, markers; RViz and a recording where asked for."""
from launch import LaunchDescription
from launch.actions import OpaqueFunction

from tactile_bringup.psd_launch import SENSOR_TYPE, psd_actions
from tactile_bringup.sensor_launch import sensor_arguments


def generate_launch_description():
    """The arguments and the nodes that they make."""
    return LaunchDescription([*sensor_arguments(SENSOR_TYPE), OpaqueFunction(function=psd_actions)])
