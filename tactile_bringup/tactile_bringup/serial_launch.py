# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The nodes of a sensor on a serial port, from the arguments of its launch file."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from launch import LaunchContext
from launch.actions import LogInfo

from .hand_processes import sensor_processes
from .marker_launch import calibration_of, with_calibration
from .sensor_launch import (SOURCES, SensorNodes, camera_parameters, check, frame_of, sensor_arguments, share, values_of,
                            with_parameter_file)


@dataclass(frozen=True)
class SerialSensor:
    """type: of sensor; driver, perception, markers: its nodes; rviz_topics: what RViz shows; uncalibrated: what to say without a
    calibration; sources: where data may come from."""

    type: str
    driver: str
    perception: str
    markers: str
    rviz_topics: Sequence[str]
    uncalibrated: str
    sources: Sequence[str] = SOURCES


PSD_FINGER = SerialSensor(
    'psd_finger', 'psd_node', 'psd_contact_node', 'finger_markers_node', ('markers',),
    'places are of a nominal finger, force and depth are not told; record presses at known places', ('sim', 'device', 'bag'))
TAXEL_ARRAY = SerialSensor(
    'taxel_array', 'taxel_array_node', 'taxel_contact_node', 'taxel_markers_node', ('image_raw', 'markers'),
    'regions, motion and slip are told, pressure and force are not; record known weights')


def serial_actions(context: LaunchContext, sensor: SerialSensor) -> list:
    """The actions for the arguments in context. Raises LaunchError."""
    values = values_of(context, sensor_arguments(sensor.type))
    return sensor_processes(serial_nodes(values, SensorNodes, sensor), values)


def serial_nodes(values: dict[str, str], make: Callable[[dict], SensorNodes], sensor: SerialSensor) -> list:
    """The same for values of the arguments, with nodes as make(values) makes them. Raises LaunchError."""
    values = with_calibration(with_parameter_file(values, sensor.type), sensor.type)
    check(values, sensor.sources)
    frame_id = frame_of(values, sensor.type)
    nodes = make(values)
    actions = [nodes.node('tactile_driver', sensor.driver, camera_parameters(values, frame_id)),
               nodes.node('tactile_perception', sensor.perception, nodes.calibrated()),
               nodes.node('tactile_bringup', sensor.markers, {'frame_id': frame_id})]
    if not (values['calibration'] or calibration_of(values['params'], sensor.perception)):
        actions.append(LogInfo(msg=f'not calibrated (calibration:=FILE): {sensor.uncalibrated} and run '
                                   '`ros2 run tactile_perception calibrate`'))
    return [*actions, *nodes.recorder(), *nodes.rviz(share('rviz', f'{sensor.type}.rviz'), frame_id, sensor.rviz_topics)]
