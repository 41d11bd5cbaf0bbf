# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""In which processes the nodes of a hand run, and what happens when one ends: the rest goes on, and it is started again."""
from __future__ import annotations

import json
from collections.abc import Callable, Sequence

from launch import LaunchContext
from launch.actions import LogInfo, Shutdown
from launch.events.process import ProcessExited
from launch_ros.actions import Node
from tactile_driver.nodes.run import WRONG

from .sensor_launch import PlannedNode

Groups = dict[str, list[PlannedNode]]  # nodes by sensor
_RESPAWN_S = 0.5
_ALONE = 'record_node'  # a disk that is slow or full must not hold up a sensor


def composed(nodes: Sequence[PlannedNode]) -> str:
    """What composed_node is told to make."""
    return json.dumps([{'node': node.executable, 'namespace': '/' + node.namespace.strip('/'), 'params_file': node.params,
                        'parameters': node.own} for node in nodes])


def ended(name: str) -> Callable:
    """What to do when the process of this name has ended: a parameter or file that is wrong ends the launch, anything else is no reason."""
    def on_exit(event: ProcessExited, context: LaunchContext):
        if event.returncode == WRONG:
            return [Shutdown(reason=f'{name}: what it was given is wrong, see above')]
        return [] if context.is_shutdown else [LogInfo(msg=f'{name} has ended with {event.returncode}; it is started again')]
    return on_exit


def _lasting(name: str) -> dict:
    """Of launch: start it again when it ends."""
    return {'respawn': True, 'respawn_delay': _RESPAWN_S, 'on_exit': ended(name)}


def _recorders(groups: Groups) -> list[Node]:
    """A recorder is not started again: its bag exists."""
    def told(name: str) -> Callable:
        return lambda event, context: [] if context.is_shutdown else [LogInfo(msg=f'recording of {name} has ended with {event.returncode}')]
    return [node.process(on_exit=told(name)) for name, nodes in groups.items() for node in nodes if node.executable == _ALONE]


def _together(name: str, nodes: Sequence[PlannedNode]) -> Node:
    return Node(package='tactile_bringup', executable='composed_node', exec_name=name.replace('/', '_'), output='screen',
                arguments=[composed(nodes)], **_lasting(name))


def _others(nodes: Sequence[PlannedNode]) -> list[PlannedNode]:
    return [node for node in nodes if node.executable != _ALONE]


def node_by_node(groups: Groups) -> list[Node]:
    """Each node is a process."""
    return [node.process(**_lasting(f'{name}/{node.executable}')) for name, nodes in groups.items() for node in _others(nodes)] \
        + _recorders(groups)


def sensor_by_sensor(groups: Groups) -> list[Node]:
    """The nodes of each sensor are a process."""
    return [_together(name, _others(nodes)) for name, nodes in groups.items()] + _recorders(groups)


def all_in_one(groups: Groups) -> list[Node]:
    """All nodes are one process."""
    return [_together('hand', [node for nodes in groups.values() for node in _others(nodes)]), *_recorders(groups)]


#: Name -> what it means, and what makes the processes.
PROCESSES: dict[str, tuple[str, Callable[[Groups], list[Node]]]] = {
    'sensor': ('one for each sensor', sensor_by_sensor), 'true': ('one for all', all_in_one), 'false': ('one for each node', node_by_node)}
