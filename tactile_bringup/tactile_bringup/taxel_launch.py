# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The nodes of a taxel array, from the arguments of its launch file."""
from __future__ import annotations

from launch import LaunchContext
from launch.actions import LogInfo

from .marker_launch import calibration_of, with_calibration
from .sensor_launch import (SOURCES, SensorNodes, camera_parameters, check, frame_of, sensor_arguments, share, values_of,
                            with_parameter_file)

SENSOR_TYPE = 'taxel_array'
RVIZ_TOPICS = ('image_raw', 'markers')


def taxel_actions(context: LaunchContext) -> list:
    """The actions for the arguments in context. Raises LaunchError."""
    values = with_calibration(with_parameter_file(values_of(context, sensor_arguments(SENSOR_TYPE)), SENSOR_TYPE), SENSOR_TYPE)
    check(values, SOURCES)
    frame_id = frame_of(values, SENSOR_TYPE)
    nodes = SensorNodes(values)
    actions = [nodes.node('tactile_driver', 'taxel_array_node', camera_parameters(values, frame_id)),
               nodes.node('tactile_perception', 'taxel_contact_node', nodes.calibrated()),
               nodes.node('tactile_bringup', 'taxel_markers_node', {'frame_id': frame_id})]
    if not (values['calibration'] or calibration_of(values['params'], 'taxel_contact_node')):
        actions.append(LogInfo(msg='not calibrated (calibration:=FILE): regions, motion and slip are told, pressure and force are not; '
                                   'record known weights and run `ros2 run tactile_perception calibrate`'))
    return [*actions, *nodes.recorder(), *nodes.rviz(share('rviz', f'{SENSOR_TYPE}.rviz'), frame_id, RVIZ_TOPICS)]
