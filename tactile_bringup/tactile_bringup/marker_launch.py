# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The nodes of a marker sheet or an air cushion, from the arguments of its launch file."""
from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from launch import LaunchContext
from launch.actions import DeclareLaunchArgument, LogInfo
from tactile_driver.errors import TactileError
from tactile_driver.nodes.parameters import Parameter
from tactile_perception.pipeline.parameter_file import read_parameters

from .hand_processes import sensor_processes
from .sensor_launch import (SOURCES, LaunchError, SensorNodes, camera_parameters, check, frame_of, sensor_arguments, share, values_of,
                            with_parameter_file)

RVIZ_TOPICS = ('image_raw', 'image_annotated', 'markers')
# The whole table takes a second to import, and launch needs only this of it.
_CALIBRATION = (Parameter('calibration', str, '', '', 'calibration file'),)


def right_arguments() -> list[DeclareLaunchArgument]:
    """The arguments that the launch file of a sensor with two cameras has besides."""
    texts = {'right_device': 'device: the right camera; device is the left one', 'right_path': 'file: the right video or folder of images'}
    return [DeclareLaunchArgument(name, default_value='', description=text) for name, text in texts.items()]


def marker_actions(context: LaunchContext, sensor_type: str, two_cameras: bool = False) -> list:
    """The actions for the arguments in context. Raises LaunchError."""
    declared = sensor_arguments(sensor_type) + (right_arguments() if two_cameras else [])
    values = values_of(context, declared)
    return sensor_processes(marker_nodes(values, SensorNodes, sensor_type, two_cameras), values)


def marker_nodes(values: dict[str, str], make: Callable[[dict], SensorNodes], sensor_type: str, two_cameras: bool = False) -> list:
    """The same for values of the arguments, with nodes as make(values) makes them. Raises LaunchError."""
    values = with_calibration(with_parameter_file(values, sensor_type), sensor_type)
    check(values, (*SOURCES, 'topics') if two_cameras else SOURCES)
    frame_id = frame_of(values, sensor_type)
    nodes = make(values)
    driver = ('dual_camera_node', two_camera_parameters(values, frame_id)) if two_cameras else \
        ('camera_node', camera_parameters(values, frame_id))
    actions = [nodes.node('tactile_driver', *driver),
               nodes.node('tactile_perception', 'dot_tracker_node', nodes.calibrated())]
    if _tells_touches(values['calibration'] or calibration_of(values['params'])):
        actions.append(nodes.node('tactile_perception', 'contact_point_node', nodes.calibrated()))
    else:
        actions.append(LogInfo(msg='not calibrated (calibration:=FILE): markers are tracked, touches are not told; record presses at '
                                   'known places and run `ros2 run tactile_perception calibrate`'))
    actions.append(nodes.node('tactile_bringup', 'markers_node', {'frame_id': frame_id} | nodes.calibrated()))
    return [*actions, *nodes.recorder(), *nodes.rviz(share('rviz', f'{sensor_type}.rviz'), frame_id, RVIZ_TOPICS)]


def two_camera_parameters(values: dict[str, str], frame_id: str) -> dict:
    """The parameters of dual_camera_node that the arguments set. Raises LaunchError."""
    chosen = {name: values[name] for name in ('right_device', 'right_path', 'right_topic') if values.get(name)}
    calibration = values['calibration'] or calibration_of(values['params'])
    return camera_parameters(values, frame_id) | chosen | ({'stitching_path': calibration} if calibration else {})


def with_calibration(values: dict[str, str], sensor_type: str) -> dict[str, str]:
    """values with the simulated specimen's calibration where it is simulated and the user gives none."""
    own = share('calibration', f'{sensor_type}_sim.yaml')
    simulated = values['source'] == 'sim' and not values['calibration'] and Path(own).is_file()
    return {**values, 'calibration': own} if simulated else values


def _tells_touches(calibration: str) -> bool:
    """Whether a calibration file holds more than a stitching; a bad one does as well: the node says what is wrong with it."""
    if not calibration:
        return False
    text = Path(calibration).read_text(errors='replace') if Path(calibration).is_file() else ''
    return not ('\n  stitching:' in text and '\n  methods:' not in text)


def calibration_of(params: str, node: str = 'contact_point_node') -> str:
    """The calibration file that a parameter file names for a node. Raises LaunchError."""
    try:
        return read_parameters(params, node, _CALIBRATION)['calibration']
    except TactileError as error:
        raise LaunchError(' '.join(str(error).split())) from error  # a parser's message has many lines
