# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The demo beside a touchpad's nodes, from the arguments of its launch file."""
from __future__ import annotations

import sys
from pathlib import Path

from launch import LaunchContext
from launch.actions import DeclareLaunchArgument, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from .arguments import number, sensor_actions
from ..parameters.table import VIDEO_RATE

SENSOR_TYPE = 'touchpad'
_LIVE_S = 25.0


def demo_arguments() -> list[DeclareLaunchArgument]:
    """The arguments that the demo has besides those of the touchpad."""
    texts = {'out': ('out/demo', 'folder for pictures and video'),
             'seconds': ('', 'how long it lasts, s; empty: 25 of a simulated sensor or a device, a recording to its end')}
    return [DeclareLaunchArgument(name, default_value=default, description=text) for name, (default, text) in texts.items()]


def demo_actions(context: LaunchContext) -> list:
    """The actions of the touchpad and the demo; launch ends with the demo. Raises LaunchError."""
    sensor = sensor_actions(context, SENSOR_TYPE, demo_arguments(), {'picture_rate': VIDEO_RATE}, apart=True)
    given = {name: LaunchConfiguration(name).perform(context) for name in ('out', 'seconds', 'source', 'namespace')}
    own = {'out': str(Path(given['out']).expanduser().absolute()), 'panel': sys.stdout.isatty(), 'seconds': duration(given)}
    # The sensor goes before the video where both want a core: nice. Without output_format launch would write the name of the process before
    # each line of the panel.
    demo = Node(package='tactile_bringup', executable='demo', name='demo', namespace=given['namespace'], output='screen',
                output_format='{line}', parameters=[own], prefix='nice -n 5',
                on_exit=Shutdown(reason='the demo is over'))
    return [*sensor, demo]


def duration(given: dict[str, str]) -> float:
    """How long the demo lasts, s, 0 for a recording's whole length. Raises LaunchError for what is no number."""
    if not given['seconds']:
        return 0.0 if given['source'] in ('file', 'bag') else _LIVE_S
    return number('seconds', given['seconds'])
