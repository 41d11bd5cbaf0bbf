# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The demo beside a sensor's nodes, from the arguments of its launch file."""
from __future__ import annotations

from pathlib import Path

from launch import LaunchContext
from launch.actions import DeclareLaunchArgument, Shutdown
from launch_ros.actions import Node
from tactile_perception.sensors import SENSOR_TYPES

from .arguments import check_choice, number, sensor_actions, sensor_arguments, values_of
from ..parameters.table import VIDEO_RATE

#: parameter of the nodes that draw pictures: how often
_PICTURES = {'markers_node': 'picture_rate', 'taxel_markers_node': 'rate'}
#: with one source of pictures
TYPES = tuple(name for name, row in SENSOR_TYPES.items() if row.view in _PICTURES and len(row.raw) == 1)
_ARRAY_FILES = ('.csv', '.npy', '.npz', '.tsv', '.txt')
_LIVE_S = 25.0


def own_arguments() -> list[DeclareLaunchArgument]:
    """The arguments that the demo has besides those of its sensor."""
    texts = {'type': ('', f'sensor type, of {", ".join(TYPES)}; empty: taxel_array for a file of an array ({" ".join(_ARRAY_FILES)}), else '
                          f'{TYPES[0]}'),
             'out': ('out/demo', 'folder for pictures and video'),
             'seconds': ('', 'how long it lasts, s; empty: 25 of a simulated sensor or a device, a recording to its end')}
    return [DeclareLaunchArgument(name, default_value=default, description=text) for name, (default, text) in texts.items()]


def demo_arguments() -> list[DeclareLaunchArgument]:
    """All arguments of the demo; its sensor's are those of a touchpad, which every sensor of TYPES has or does without."""
    space = DeclareLaunchArgument('namespace', default_value='', description="of the sensor's nodes and topics; empty: the sensor type")
    return [space, *(each for each in sensor_arguments(TYPES[0]) if each.name not in ('namespace', 'stay')), *own_arguments()]


def demo_actions(context: LaunchContext) -> list:
    """The actions of the sensor and the demo; launch ends with the demo. Raises BadArgument."""
    given = values_of(context, demo_arguments())
    kind = given['type'] or ('taxel_array' if Path(given['path']).suffix in _ARRAY_FILES else TYPES[0])
    check_choice('type', kind, TYPES)
    given['namespace'] = given['namespace'] or kind
    # The demo ends the launch, with the last picture written.
    context.launch_configurations.update(namespace=given['namespace'], stay='true')
    sensor = sensor_actions(context, kind, own_arguments(), {_PICTURES[SENSOR_TYPES[kind].view]: VIDEO_RATE}, apart=True)
    own = {'out': str(Path(given['out']).expanduser().absolute()), 'seconds': duration(given)}
    # The sensor goes before the video where both want a core: nice.
    demo = Node(package='tactile_bringup', executable='demo', name='demo', namespace=given['namespace'], output='screen',
                output_format='{line}', parameters=[own], prefix='nice -n 5',
                on_exit=Shutdown(reason='the demo is over'))
    return [*sensor, demo]


def duration(given: dict[str, str]) -> float:
    """How long the demo lasts, s, 0 for a recording's whole length. Raises BadArgument for what is no number."""
    if not given['seconds']:
        return 0.0 if given['source'] in ('file', 'bag') else _LIVE_S
    return number('seconds', given['seconds'])
