# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The nodes of a touchpad, from the arguments of its launch file."""
from __future__ import annotations

from collections.abc import Callable

from launch import LaunchContext
from tactile_driver.errors import TactileError
from tactile_driver.nodes.parameters import Parameter
from tactile_perception.pipeline.parameter_file import read_parameters

from .hand_processes import sensor_processes
from .sensor_launch import (LaunchError, SensorNodes, camera_parameters, check, frame_of, sensor_arguments, share, values_of,
                            with_parameter_file)

SENSOR_TYPE = 'touchpad'
RVIZ_TOPICS = ('image_raw', 'image_annotated', 'markers')
# The whole table takes a second to import, and launch needs only this of it.
_SURFACE = (Parameter('surface', str, 'cap', '', 'rest shape that places dots in 3D'),)


def touchpad_actions(context: LaunchContext) -> list:
    """The actions for the arguments in context. Raises LaunchError."""
    values = values_of(context, sensor_arguments(SENSOR_TYPE))
    return sensor_processes(touchpad_nodes(values, SensorNodes), values)


def touchpad_nodes(values: dict[str, str], make: Callable[[dict], SensorNodes]) -> list:
    """The same for values of the arguments, with nodes as make(values) makes them. Raises LaunchError."""
    values = with_parameter_file(values, SENSOR_TYPE)
    check(values)
    frame_id = frame_of(values, SENSOR_TYPE)
    nodes = make(values)
    actions = [nodes.node('tactile_driver', 'camera_node', camera_parameters(values, frame_id)),
               nodes.node('tactile_perception', 'dot_tracker_node', nodes.calibrated())]
    if has_surface(values['params']):
        actions.append(nodes.node('tactile_perception', 'contact_region_node', nodes.calibrated()))
    actions.append(nodes.node('tactile_bringup', 'markers_node', {'frame_id': frame_id}))
    return [*actions, *nodes.recorder(), *nodes.rviz(share('rviz', 'touchpad.rviz'), frame_id, RVIZ_TOPICS)]


def has_surface(params: str) -> bool:
    """Whether a parameter file gives the dots places in 3D, without which there is no contact region. Raises LaunchError."""
    try:
        return read_parameters(params, 'dot_tracker_node', _SURFACE)['surface'] != 'none'
    except TactileError as error:
        raise LaunchError(' '.join(str(error).split())) from error  # a parser's message has many lines
