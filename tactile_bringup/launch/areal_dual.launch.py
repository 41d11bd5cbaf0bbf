# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A soft sheet with printed markers and two cameras under it: driver, perception, markers; RViz and a recording where asked for."""
from functools import partial

from launch import LaunchDescription
from launch.actions import OpaqueFunction

from tactile_bringup.marker_launch import marker_actions, right_arguments
from tactile_bringup.sensor_launch import sensor_arguments

SENSOR_TYPE = 'areal_dual'


def generate_launch_description():
    """The arguments and the nodes that they make."""
    actions = OpaqueFunction(function=partial(marker_actions, sensor_type=SENSOR_TYPE, two_cameras=True))
    return LaunchDescription([*sensor_arguments(SENSOR_TYPE), *right_arguments(), actions])
