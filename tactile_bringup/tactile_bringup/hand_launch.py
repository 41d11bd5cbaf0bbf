# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""All sensors of a hand, from the arguments of its launch file: each by the lines of its own launch file."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch import LaunchContext
from launch.actions import DeclareLaunchArgument, LogInfo
from launch.logging import launch_config
from launch_ros.actions import Node
from tactile_driver.errors import TactileError
from tactile_driver.nodes.camera_parameters import CAMERA_PARAMETERS
from tactile_driver.nodes.dual_camera_parameters import DUAL_CAMERA_PARAMETERS
from tactile_driver.nodes.psd_parameters import PSD_DRIVER_PARAMETERS
from tactile_driver.nodes.taxel_parameters import TAXEL_DRIVER_PARAMETERS
from tactile_perception.pipeline.parameter_file import read_parameters

from .hand_diagnostics import aggregator_configuration
from .hand_file import Hand, HandSensor, read_hand
from .hand_processes import PROCESSES, PlannedNode, hand_processes
from .hand_rviz import rviz_configuration
from .marker_launch import marker_nodes
from .recorded import bag_of, was_simulated
from .sensor_launch import LaunchError, SensorNodes, sensor_arguments, share, values_of
from .serial_launch import PSD_FINGER, TAXEL_ARRAY, serial_nodes
from .touchpad_launch import touchpad_nodes

SOURCES = ('sim', 'device', 'bag')
MAKERS: dict[str, Callable[[dict, Callable], list]] = {
    'touchpad': touchpad_nodes,
    'areal_single': partial(marker_nodes, sensor_type='areal_single'),
    'areal_dual': partial(marker_nodes, sensor_type='areal_dual', two_cameras=True),
    'air_cushion': partial(marker_nodes, sensor_type='air_cushion'),
    'psd_finger': partial(serial_nodes, sensor=PSD_FINGER),
    'taxel_array': partial(serial_nodes, sensor=TAXEL_ARRAY),
}
#: Drivers wait for somebody to set a parameter right; what their file has wrong ought to end the launch all the same.
_DRIVERS = {'camera_node': CAMERA_PARAMETERS, 'dual_camera_node': DUAL_CAMERA_PARAMETERS, 'psd_node': PSD_DRIVER_PARAMETERS,
            'taxel_array_node': TAXEL_DRIVER_PARAMETERS}
# The topics that a driver plays of a bag which has those of other sensors too.
_RECORDED = {'psd_finger': {'topic': 'voltages'}, 'areal_dual': {'topic': 'left/image_raw', 'right_topic': 'right/image_raw'}}
_CHOICES = {'source': SOURCES, 'composed': tuple(PROCESSES), 'rviz': ('true', 'false'), 'aggregator': ('true', 'false')}


def hand_arguments() -> list[DeclareLaunchArgument]:
    """The arguments of hand.launch.py; what holds for one sensor is in the hand's file."""
    texts = {
        'hand': (share('hands', 'example_hand.yaml'), 'YAML file with the sensors of the hand; where none is given an example'),
        'source': ('sim', 'where data comes from: ' + ', '.join(SOURCES)),
        'path': ('', 'bag: a recording of the hand: a bag with the topics of all sensors, or a folder with one of each, as record makes'),
        'composed': ('sensor', 'processes: ' + '; '.join(f'{name}: {about}' for name, (about, _) in PROCESSES.items())),
        'autostart': ('', 'false: drivers wait, unconfigured, for their lifecycle services; empty: what the parameter files say, true'),
        'loop': ('', 'bag: start again at the end, true or false; empty: what the parameter files say'),
        'record': ('', 'folder to write, with one bag (MCAP) of each sensor; empty: none'),
        'rviz': ('false', 'show the hand in RViz: true or false'),
        'aggregator': ('false', 'group /diagnostics by sensors with diagnostic_aggregator: true or false'),
    }
    return [DeclareLaunchArgument(name, default_value=default, description=text) for name, (default, text) in texts.items()]


class HandNodes(SensorNodes):
    """Plans the nodes of one sensor of a hand. RViz is started for all of them at once."""

    def rviz(self, *_arguments) -> list:
        """See the class."""
        return []


@dataclass(frozen=True)
class PlannedSensor:
    """What a sensor needs: nodes to be started, and what launch has to say about it."""

    name: str
    nodes: list[PlannedNode]
    notes: list[LogInfo]


def hand_actions(context: LaunchContext) -> list:
    """The actions for the arguments in context. Raises LaunchError."""
    values = values_of(context, hand_arguments())
    for name, choices in _CHOICES.items():
        if values[name] not in choices:
            raise LaunchError(f'{name}:={values[name]} is none of {", ".join(choices)}')
    if values['record'] and Path(values['record']).exists():
        raise LaunchError(f'record:={values["record"]} exists already: choose another name or remove it')
    try:
        hand = read_hand(values['hand'])
    except TactileError as error:
        raise LaunchError(str(error)) from error
    sensors = [planned_sensor(sensor, values) for sensor in hand.sensors]
    frames = PlannedNode('tactile_bringup', 'hand_frames_node', '/', own={'hand': str(Path(values['hand']).expanduser().absolute())})
    groups = {sensor.name: sensor.nodes for sensor in sensors} | {hand.frame: [frames]}
    return [*(note for sensor in sensors for note in sensor.notes), *hand_processes(groups, values['composed']),
            *_viewer(hand, values['rviz'] == 'true'), *_aggregator(hand, values['aggregator'] == 'true')]


def planned_sensor(sensor: HandSensor, given: dict[str, str]) -> PlannedSensor:
    """What a sensor needs, for the arguments given for the hand. Raises LaunchError, which names the sensor."""
    try:
        entities = MAKERS[sensor.type](sensor_values(sensor, given), HandNodes)
        nodes = [entity for entity in entities if isinstance(entity, PlannedNode)]
        for node in nodes:
            if node.executable in _DRIVERS:
                read_parameters(node.params, node.executable, _DRIVERS[node.executable])
    except (LaunchError, TactileError) as error:
        raise LaunchError(f'hand {given["hand"]}: sensor {sensor.name}: {" ".join(str(error).split())}') from error
    notes = [LogInfo(msg=[f'{sensor.name}: ', *entity.msg]) for entity in entities if isinstance(entity, LogInfo)]
    return PlannedSensor(sensor.name, nodes, notes)


def sensor_values(sensor: HandSensor, given: dict[str, str]) -> dict[str, str]:
    """The arguments of the sensor's own launch file. Raises BadArgument where a recording has nothing of it."""
    values = {argument.name: '' for argument in sensor_arguments(sensor.type)} | {'right_device': '', 'right_path': ''}
    values.update(sensor.settings, namespace=sensor.name, source=given['source'], rviz='false', autostart=given['autostart'],
                  composed=given['composed'])
    if given['record']:
        values['record'] = str(Path(given['record']).expanduser() / sensor.frame)
    simulated = given['source'] == 'sim'
    if given['source'] == 'bag':
        if not given['path']:
            raise LaunchError('source:=bag needs the recording: path:=...')
        path = bag_of(given['path'], sensor.name)
        topics = _RECORDED.get(sensor.type, {'topic': 'image_raw'})
        values.update(path=path, loop=given['loop'], rate='', **{key: f'/{sensor.name}/{topic}' for key, topic in topics.items()})
        simulated = was_simulated(path, sensor.name)
    if simulated:  # the simulated specimen's own, whatever the real sensor's are
        calibration = Path(share('calibration', f'{sensor.type}_sim.yaml'))
        values.update(device='', right_device='', params=share('params', f'{sensor.type}_sim.yaml'),
                      calibration=str(calibration) if calibration.is_file() else '')
    return values


def _written(hand: Hand, name: str, text: str) -> str:
    """The path of a file with this text, kept beside the log of the launch."""
    path = Path(launch_config.log_dir, f'{hand.frame.replace("/", "_")}{name}')
    path.write_text(text)
    return str(path)


def _optional(package: str, executable: str, **how) -> list:
    """A node of a package that may be missing: then one line says so."""
    try:
        get_package_prefix(package)
    except PackageNotFoundError:
        return [LogInfo(msg=f'package {package} is not installed: {executable} is left out, everything else is started')]
    return [Node(package=package, executable=executable, output='screen', **how)]


def _viewer(hand: Hand, wanted: bool) -> list:
    if not wanted:
        return []
    file = _written(hand, '.rviz', rviz_configuration(hand))
    return [LogInfo(msg=f'RViz configuration of the hand: {file}'), *_optional('rviz2', 'rviz2', name='rviz2', arguments=['-d', file])]


def _aggregator(hand: Hand, wanted: bool) -> list:
    if not wanted:
        return []
    file = _written(hand, '_diagnostics.yaml', aggregator_configuration(hand))
    return [LogInfo(msg=f'configuration of diagnostic_aggregator: {file}'),
            *_optional('diagnostic_aggregator', 'aggregator_node', name='analyzers', parameters=[file])]
