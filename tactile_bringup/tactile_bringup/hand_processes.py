# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""In which processes the nodes of a hand, or of one sensor, run; when one ends, the rest goes on, and it is started again.

launch starts one process, hand_node (nodes/keeper.py), which forks the others; a recorder is a process of its own beside it.
"""
from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field

from launch import LaunchContext
from launch.actions import LogInfo, Shutdown
from launch.events.process import ProcessExited
from launch_ros.actions import Node
from tactile_driver.nodes.run import WRONG


@dataclass(frozen=True)
class PlannedNode:
    """A node that is to be started. params: its parameter file, '' for none; own: parameters by name that go before those of the file."""

    package: str
    executable: str
    namespace: str
    params: str = ''
    own: dict = field(default_factory=dict)

    def process(self, **exit_actions) -> Node:
        """The action that starts it as a process of its own; exit_actions: of launch, what happens when it ends."""
        return Node(package=self.package, executable=self.executable, name=self.executable, namespace=self.namespace, output='screen',
                    parameters=[given for given in (self.params, self.own) if given], **exit_actions)


Groups = dict[str, list[PlannedNode]]  # nodes by sensor, or by process
_RESPAWN_S = 0.5
_ALONE = 'record_node'  # a disk that is slow or full must not hold up a sensor


def hand_processes(groups: Groups, composed: str) -> list[Node]:
    """What starts the nodes of all sensors; composed: which of them share a process, one of PROCESSES."""
    shared = PROCESSES[composed][1]({name: [node for node in nodes if node.executable != _ALONE] for name, nodes in groups.items()})
    hand = Node(package='tactile_bringup', executable='hand_node', exec_name='hand', output='screen', arguments=[told(shared)],
                respawn=True, respawn_delay=_RESPAWN_S, on_exit=_on_exit)
    return [hand, *_recorders(groups)]


def sensor_processes(entities: list, values: dict[str, str]) -> list:
    """The planned nodes among the entities of a sensor's launch file as what starts them; the rest as it is."""
    nodes = [entity for entity in entities if isinstance(entity, PlannedNode)]
    others = [entity for entity in entities if not isinstance(entity, PlannedNode)]
    return [*hand_processes({values['namespace'].strip('/') or 'sensor': nodes}, values['composed']), *others]


def told(groups: Groups) -> str:
    """What hand_node is told to run."""
    return json.dumps({name: [{'node': node.executable, 'namespace': '/' + node.namespace.strip('/'), 'params_file': node.params,
                               'parameters': node.own} for node in nodes] for name, nodes in groups.items()})


def _on_exit(event: ProcessExited, context: LaunchContext):
    """A parameter or file that is wrong ends the launch, anything else is no reason."""
    if event.returncode == WRONG:
        return [Shutdown(reason='what a node was given is wrong, see above')]
    return [] if context.is_shutdown else [LogInfo(msg=f'hand_node has ended with {event.returncode}; it is started again')]


def _recorders(groups: Groups) -> list[Node]:
    """A recorder is not started again: its bag exists."""
    def on_exit(name: str) -> Callable:
        return lambda event, context: [] if context.is_shutdown else [LogInfo(msg=f'recording of {name} has ended with {event.returncode}')]
    return [node.process(on_exit=on_exit(name)) for name, nodes in groups.items() for node in nodes if node.executable == _ALONE]


def _all_in_one(groups: Groups) -> Groups:
    return {'hand': [node for nodes in groups.values() for node in nodes]}


def _node_by_node(groups: Groups) -> Groups:
    return {f'{name}/{node.executable}': [node] for name, nodes in groups.items() for node in nodes}


#: Name -> what it means, and the nodes of each process from those of each sensor.
PROCESSES: dict[str, tuple[str, Callable[[Groups], Groups]]] = {
    'sensor': ('one for each sensor', dict), 'true': ('one for all', _all_in_one), 'false': ('one for each node', _node_by_node)}
