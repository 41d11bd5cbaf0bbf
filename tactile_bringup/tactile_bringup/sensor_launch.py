# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the launch files of the sensors share: their arguments, and the actions that these make."""
from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_prefix, get_package_share_directory
from launch import LaunchContext
from launch.actions import DeclareLaunchArgument, LogInfo
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from .hand_processes import PROCESSES, PlannedNode

SOURCES = ('sim', 'device', 'file', 'bag')
_BOOLEANS = {'true': True, 'false': False}


class LaunchError(ValueError):
    """A launch argument is wrong; the message is the one line that the user gets to see."""


def share(*parts: str) -> str:
    """The path of an installed file of this package."""
    return str(Path(get_package_share_directory('tactile_bringup'), *parts))


def sensor_arguments(sensor_type: str) -> list[DeclareLaunchArgument]:
    """The arguments that the launch file of every sensor has."""
    texts = {
        'namespace': (sensor_type, "of the sensor's nodes and topics; the sensor frame is named after it"),
        'source': ('sim', 'where data comes from: ' + ', '.join(SOURCES)),
        'device': ('', 'device: index, /dev path, name under /dev/v4l/by-id, or part of a serial number'),
        'path': ('', 'file, bag: the video, folder of images or rosbag2 folder'),
        'params': ('', f'parameter file of all nodes; empty: params/{sensor_type}.yaml, with source sim params/{sensor_type}_sim.yaml'),
        'calibration': ('', 'calibration file, as calibrate writes it; empty: what the parameter file says'),
        'rviz': ('false', 'show it in RViz: true or false'),
        'record': ('', 'bag (MCAP) to write; empty: none'),
        'rate': ('', "Hz; file, bag: 0 for as fast as it is consumed; empty: the source's own"),
        'loop': ('', 'file, bag: start again at the end, true or false; empty: what the parameter file says'),
        'scene': ('', 'sim: the scene; empty: what the parameter file says'),
        'autostart': ('', 'false: the driver waits, unconfigured, for its lifecycle services; empty: what the parameter file says, true'),
        'composed': ('false', 'true: all nodes in one process, in which images go from one to the next by a call; false: one for each, '
                              'so that raw data never wait for what is computed from them'),
    }
    # No choices: launch would say a wrong one twice; check says it once.
    return [DeclareLaunchArgument(name, default_value=default, description=text) for name, (default, text) in texts.items()]


def values_of(context: LaunchContext, arguments: Sequence[DeclareLaunchArgument]) -> dict[str, str]:
    """Name -> value as given, of the arguments declared."""
    return {a.name: LaunchConfiguration(a.name).perform(context) for a in arguments}


def with_parameter_file(values: dict[str, str], sensor_type: str) -> dict[str, str]:
    """values with the package's own parameter file where the user gives none; the simulated specimen has one of its own."""
    own = f'{sensor_type}_sim.yaml' if values['source'] == 'sim' else f'{sensor_type}.yaml'
    return {**values, 'params': values['params'] or share('params', own)}


def check(values: dict[str, str], sources: Sequence[str] = SOURCES) -> None:
    """What can be told before any node runs. Raises LaunchError."""
    for name, choices in {'source': sources, 'rviz': tuple(_BOOLEANS), 'loop': ('', *_BOOLEANS), 'autostart': ('', *_BOOLEANS),
                          'composed': tuple(PROCESSES)}.items():
        if values[name] not in choices:
            raise LaunchError(f'{name}:={values[name]} is none of {", ".join(filter(None, choices))}')
    _check_files(values)


def _check_files(values: dict[str, str]) -> None:
    if values['source'] in ('file', 'bag'):
        if not values['path']:
            raise LaunchError(f'source:={values["source"]} needs the recording: path:=...')
        if not Path(values['path']).expanduser().exists():
            raise LaunchError(f'path:={values["path"]} does not exist')
    for name in ('params', 'calibration'):
        if values[name] and not Path(values[name]).is_file():
            raise LaunchError(f'{name}:={values[name]} is no file')
    if values['record'] and Path(values['record']).exists():
        raise LaunchError(f'record:={values["record"]} exists already: choose another name or remove it')


def number(name: str, text: str) -> float:
    """The number that an argument gives, 0 or more. Raises LaunchError."""
    try:
        value = float(text)
    except ValueError:
        raise LaunchError(f'{name}:={text} is no number') from None
    if not 0.0 <= value < math.inf:
        raise LaunchError(f'{name}:={text} must be 0 or more')
    return value


def frame_of(values: dict[str, str], sensor_type: str) -> str:
    """The name of the sensor frame: the namespace in one word."""
    return values['namespace'].strip('/').replace('/', '_') or sensor_type


def camera_parameters(values: dict[str, str], frame_id: str) -> dict:
    """The parameters of camera_node that the arguments set. Raises LaunchError for a rate that is no rate."""
    chosen = {'source': values['source'], 'frame_id': frame_id}
    chosen.update({name: values[name] for name in ('device', 'path', 'topic', 'scene') if values.get(name)})
    chosen.update({name: _BOOLEANS[values[name]] for name in ('loop', 'autostart') if values[name]})
    if values['rate']:
        chosen['rate'] = number('rate', values['rate'])
    return chosen


class SensorNodes:
    """Plans the nodes of one sensor, all with its namespace and parameter file."""

    def __init__(self, values: dict[str, str]):
        self._values = values

    def node(self, package: str, executable: str, own: dict | None = None) -> PlannedNode:
        """One node; own: parameters by name that go before those of the parameter file."""
        return PlannedNode(package, executable, self._values['namespace'], self._values['params'], own or {})

    def calibrated(self) -> dict[str, str]:
        """The parameter calibration, where the argument sets it."""
        return {'calibration': self._values['calibration']} if self._values['calibration'] else {}

    def recorder(self) -> list:
        """record_node where the argument record names a bag. It does not wait for somebody who works on raw data where that is in one
        process with the driver and is not seen."""
        if not self._values['record']:
            return []
        patience = {} if self._values['composed'] == 'false' else {'patience': 0.0}
        return [self.node('tactile_bringup', 'record_node', {'bag': self._values['record'], **patience})]

    def rviz(self, configuration: str, frame_id: str, topics: Sequence[str]) -> list:
        """RViz where the argument rviz asks for it; topics: those that the configuration shows, under the sensor type's own namespace."""
        if not _BOOLEANS[self._values['rviz']]:
            return []
        try:
            get_package_prefix('rviz2')
        except PackageNotFoundError:
            return [LogInfo(msg='rviz:=true: RViz (package rviz2) is not installed; everything else is started')]
        own = Path(configuration).stem
        namespace = '/' + self._values['namespace'].strip('/') if self._values['namespace'].strip('/') else ''
        return [Node(package='rviz2', executable='rviz2', name='rviz2', namespace=self._values['namespace'], output='screen',
                     arguments=['-d', configuration, '-f', frame_id],
                     remappings=[(f'/{own}/{topic}', f'{namespace}/{topic}') for topic in topics])]
