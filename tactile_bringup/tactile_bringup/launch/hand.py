# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""All sensors of a hand, each started as its own launch file does."""
from __future__ import annotations

from pathlib import Path

from launch import LaunchDescription
from launch.actions import LogInfo
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from tactile_driver.errors import BadArgument, TactileError
from tactile_perception.core.sensor_type import SENSOR_TYPES

from .. import share
from ..hand.configurations import aggregator_configuration, rviz_configuration, text_parameters
from ..hand.description import Hand, HandSensor, read_hand
from .arguments import (
    VIEW,
    Playing,
    SensorPlan,
    Texts,
    check_choices,
    description,
    hand_node,
    optional,
    processes,
    rerun_view,
    sensor_arguments,
    sensor_plan,
    written,
)

_BOOLEANS = ('true', 'false')
_CHOICES = {'source': ('sim', 'device', 'bag'), **dict.fromkeys(('composed', 'stay', 'rviz', *VIEW, 'aggregator', 'object'), _BOOLEANS)}


def hand_description() -> LaunchDescription:
    """The launch file."""
    return description(hand_arguments(), hand_actions)


def hand_arguments() -> Texts:
    """The arguments of hand.launch.py; those of single sensors are in the YAML file of the hand."""
    return {
        'hand': (share('hands', 'example_hand.yaml'), 'YAML file with the sensors of the hand; without it an example'),
        'description': ('', "the hand's URDF or xacro file with its sensors, in place of a YAML file"),
        'source': ('sim', 'where data comes from: ' + ', '.join(_CHOICES['source'])),
        'path': ('', 'bag: a recording of the hand: a bag with the topics of all sensors, or a folder with one of each, as record makes'),
        'composed': ('true', 'true: one process for each sensor; false: one for each node, for debugging'),
        'autostart': ('', 'false: drivers wait, unconfigured, for their lifecycle services; empty: what the parameter files say, true'),
        'loop': ('', 'bag: start again at the end, true or false; empty: what the parameter files say'),
        'stay': ('false', 'bag: true keeps the nodes when the recordings are over; false: the launch ends with the last of them'),
        'record': ('', 'folder to write, with one bag (MCAP) of each sensor; empty: none'),
        'rviz': ('false', 'show the hand in RViz: true or false'),
        **VIEW,
        'object': ('false', 'follow the held object and publish its frame on /tf: true or false'),
        'aggregator': ('false', 'group /diagnostics by sensors with diagnostic_aggregator: true or false'),
    }


def hand_actions(values: dict[str, str]) -> list:
    """The actions for the values of the arguments. Raises BadArgument."""
    check_choices(values, _CHOICES)
    if values['record'] and Path(values['record']).exists():
        raise BadArgument(f'record:={values["record"]} exists already: choose another name or remove it')
    if values['description']:
        if values['hand'] != share('hands', 'example_hand.yaml'):
            raise BadArgument('hand and description are both given; give one')
        values = {**values, 'hand': values['description']}
    hand = read_hand(values['hand'])
    plans = {sensor.name: planned_sensor(sensor, values) for sensor in hand.sensors}
    for sensor in hand.sensors:
        plans[sensor.name].nodes[SENSOR_TYPES[sensor.type].view].update(text_parameters(hand, sensor))
    playing = Playing(sum(plan.ends for plan in plans.values()))
    return [*(LogInfo(msg=f'{name}: {plan.note}') for name, plan in plans.items() if plan.note),
            *(node for plan in plans.values() for node in processes(plan, values['composed'] == 'true', playing)),
            *_frames(hand, values), *_shown(hand, values['rviz'] == 'true', values['aggregator'] == 'true'),
            *rerun_view(values)]


def _frames(hand: Hand, values: dict[str, str]) -> list:
    """One publisher of the frames: robot_state_publisher for a hand with a URDF where it is installed, else hand_node."""
    state_publisher = optional('robot_state_publisher', 'robot_state_publisher', parameters=[
        {'robot_description': ParameterValue(hand.robot.text, value_type=str)}]) if hand.robot else []
    has_publisher = any(isinstance(action, Node) for action in state_publisher)
    return [*(state_publisher if has_publisher else ()),
            hand_node(values['hand'], publish_frames=not has_publisher, object=values['object'] == 'true',
                      simulated_joints=hand.robot is not None and values['source'] == 'sim')]


def planned_sensor(sensor: HandSensor, given: dict[str, str]) -> SensorPlan:
    """The nodes of a sensor, for the arguments given for the hand. Raises BadArgument, which names the sensor."""
    try:
        return sensor_plan(sensor_values(sensor, given), sensor.type)
    except TactileError as error:
        raise BadArgument(f'hand {given["hand"]}: sensor {sensor.name}: {" ".join(str(error).split())}') from error


def sensor_values(sensor: HandSensor, given: dict[str, str]) -> dict[str, str]:
    """The arguments of the sensor's own launch file. Raises BadArgument where a recording has nothing of it."""
    values = dict.fromkeys(sensor_arguments(sensor.type), '') | sensor.settings
    values.update({name: given[name] for name in ('source', 'autostart', 'composed', 'stay')}, namespace=sensor.name,
                  **dict.fromkeys(('rviz', *VIEW), 'false'))
    if given['record']:
        values['record'] = str(Path(given['record']).expanduser() / sensor.frame)
    simulated = given['source'] == 'sim'
    if given['source'] == 'bag':
        from .recorded import bag_of, recorded_topics  # takes half a second; only this source needs it
        if not given['path']:
            raise BadArgument('source:=bag needs the recording: path:=...')
        path = bag_of(given['path'], sensor.name)
        topics = {name: f'/{sensor.name}/{topic}' for name, topic in SENSOR_TYPES[sensor.type].raw.items()}
        values.update(topics, path=path, loop=given['loop'], rate='')
        simulated = recorded_topics(path, sensor.type, sensor.name, topics)[1]
    if simulated:  # the simulated specimen has its own files
        values.update({name: '' for name in ('device', 'right_device', 'params', 'calibration') if name in values})
    return values


def _shown(hand: Hand, rviz: bool, aggregator: bool) -> list:
    """RViz and diagnostic_aggregator, where they are wanted, with configurations for this hand."""
    name, found = hand.frame.replace('/', '_'), []
    if rviz:
        file = written(f'{name}.rviz', rviz_configuration(hand))
        found += [LogInfo(msg=f'RViz configuration of the hand: {file}'), *optional('rviz2', 'rviz2', name='rviz2', arguments=['-d', file])]
    if aggregator:
        file = written(f'{name}_diagnostics.yaml', aggregator_configuration(hand))
        found += [LogInfo(msg=f'configuration of diagnostic_aggregator: {file}'),
                  *optional('diagnostic_aggregator', 'aggregator_node', name='analyzers', parameters=[file])]
    return found
