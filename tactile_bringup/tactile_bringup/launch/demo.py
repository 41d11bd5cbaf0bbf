# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The demo beside a sensor's nodes, from the arguments of its launch file."""
from __future__ import annotations

from pathlib import Path

from launch import LaunchDescription
from launch.actions import Shutdown
from launch_ros.actions import Node

from tactile_driver.sources.array_file import ARRAY_ENDINGS
from tactile_perception.core.sensor_type import SENSOR_TYPES

from ..parameters.table import VIDEO_RATE
from .arguments import absolute, check_choices, description, number, parameter_of, sensor_actions, sensor_arguments

#: parameter of the nodes that draw pictures: how often
_PICTURES = {'markers_node': 'picture_rate', 'taxel_markers_node': 'rate', 'surface_markers_node': 'rate',
             'force_markers_node': 'rate'}
#: with one source of pictures
TYPES = tuple(name for name, row in SENSOR_TYPES.items() if row.view in _PICTURES and len(row.raw) == 1)
_LIVE_S = 25.0


def demo_description() -> LaunchDescription:
    """The launch file. Its sensor's arguments are those of a touchpad, which every sensor of TYPES has or does without."""
    of_sensor = {name: row for name, row in sensor_arguments(TYPES[0]).items() if name != 'stay'}
    return description(of_sensor | {
        'namespace': ('', "of the sensor's nodes and topics; empty: the sensor type"),
        'type': ('', f'sensor type, of {", ".join(TYPES)}; empty: that of the parameter file, else taxel_array for a file of an array '
                     f'({" ".join(ARRAY_ENDINGS)}) or a folder of mostly them, else {TYPES[0]}'),
        'out': ('out/demo', 'folder for pictures and video'),
        'seconds': ('', 'how long it lasts, s; empty: 25 of a simulated sensor or a device, a recording to its end')}, _actions)


def type_of(values: dict[str, str]) -> str:
    """The sensor type that the parameter file or the recording shows. Raises BadArgument for a parameter file that cannot be read."""
    if values['params']:
        return parameter_of(values['params'], '', 'sensor_type', TYPES[0])
    path = Path(values['path']).expanduser()
    files = list(path.iterdir()) if values['source'] == 'file' and path.is_dir() else [path]
    return 'taxel_array' if 2 * sum(file.suffix.lower() in ARRAY_ENDINGS for file in files) > len(files) else TYPES[0]


def _actions(values: dict[str, str]) -> list:
    """The actions of the sensor and the demo; launch ends with the demo, with the last picture written. Raises BadArgument."""
    kind = values['type'] or type_of(values)
    check_choices({'type': kind}, {'type': TYPES})
    values = values | {'namespace': values['namespace'] or kind, 'stay': 'true'}
    sensor = sensor_actions(values, kind, {_PICTURES[SENSOR_TYPES[kind].view]: VIDEO_RATE}, apart=True)
    live_s = 0.0 if values['source'] in ('file', 'bag') else _LIVE_S
    own = {'out': absolute(values['out']), 'seconds': number(values, 'seconds') if values['seconds'] else live_s}
    # The sensor goes before the video where both want a core: nice.
    return [*sensor, Node(package='tactile_bringup', executable='demo', name='demo', namespace=values['namespace'], output='screen',
                          output_format='{line}', parameters=[own], prefix='nice -n 5', on_exit=Shutdown(reason='the demo is over'))]
