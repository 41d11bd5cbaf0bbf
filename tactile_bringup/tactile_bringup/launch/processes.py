# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The processes that launch starts: one for all nodes of a sensor or one per node, restarted when they die."""
from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from launch import LaunchContext
from launch.events.process import ProcessExited
from launch.logging import launch_config
from launch_ros.actions import Node
from tactile_driver.nodes.runtime.run import WRONG

from tactile_perception.sensors import NODES

_RESPAWN_S = 0.5


class LaunchError(ValueError):
    """A wrong launch argument; the message is one line for the user. It ends the launch."""


@dataclass(frozen=True)
class SensorPlan:
    """The nodes of one sensor. frame: the sensor frame; params: parameter file of all nodes; nodes: name -> parameters that override the
    file; bag: to record, '' for none; notes: lines that launch logs."""

    frame: str
    namespace: str
    params: str
    nodes: Mapping[str, Mapping[str, object]]
    bag: str = ''
    notes: tuple[str, ...] = ()


def processes(plan: SensorPlan, composed: bool, apart: str = '') -> list[Node]:
    """The processes of the sensor: one for all nodes, or one per node; apart: a node that has its own in any case.

    The recorder is always a process of its own, since a slow or full disk must not delay the sensor; it is not restarted, since its bag
    exists.
    """
    given = {'namespace': plan.namespace, 'output': 'screen', 'parameters': [plan.params, own_parameters(plan)], 'on_exit': end_if_wrong}
    again = {**given, 'respawn': True, 'respawn_delay': _RESPAWN_S}
    if composed:
        together = [name for name in plan.nodes if name != apart]
        started = [Node(package='tactile_bringup', executable='sensor_nodes', exec_name=plan.frame, arguments=together, **again)]
    else:
        started = []
    started += [Node(package=NODES[name].partition('.')[0], executable=name, exec_name=f'{plan.frame}/{name}', **again)
                for name in plan.nodes if not composed or name == apart]
    if plan.bag:
        # It does not wait for somebody who works on raw data where that is in one process with the driver and is not seen.
        own = {'bag': plan.bag, **({'patience': 0.0} if composed else {})}
        given['parameters'] = [plan.params, own]
        started.append(Node(package='tactile_bringup', executable='record_node', **given))
    return started


def hand_frames(hand: str | Path) -> Node:
    """The process that publishes the frames of the sensors of a hand; hand: its file."""
    return Node(package='tactile_bringup', executable='hand_frames_node', output='screen', respawn=True, respawn_delay=_RESPAWN_S,
                parameters=[{'hand': str(Path(hand).expanduser().absolute())}], on_exit=end_if_wrong)


def end_if_wrong(event: ProcessExited, context: LaunchContext) -> None:
    """End the launch when a process exits because of a wrong parameter or file. Raises LaunchError, with which launch fails."""
    if event.returncode == WRONG and not context.is_shutdown:
        raise LaunchError(f'{event.process_name}: what it was given is wrong, see above')


def written(name: str, text: str) -> str:
    """The path of a file with this text, kept beside the log of the launch."""
    path = Path(launch_config.log_dir, name)
    path.write_text(text)
    return str(path)


def own_parameters(plan: SensorPlan) -> str:
    """The path of a parameter file with each node's own; JSON is YAML in which numbers and texts cannot be taken for each other."""
    space = f'/{plan.namespace.strip("/")}'.rstrip('/')
    page = {f'{space}/{name}': {'ros__parameters': own} for name, own in plan.nodes.items() if own}
    return written(f'{plan.frame}_parameters.yaml', json.dumps(page, indent=2, ensure_ascii=False))
