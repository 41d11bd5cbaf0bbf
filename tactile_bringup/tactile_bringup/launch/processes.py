# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What launch starts: the nodes of a sensor in one process, or each in its own; whatever dies is started again."""
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

from ..sensor_types import NODES

_RESPAWN_S = 0.5


class LaunchError(ValueError):
    """What launch was given is wrong; the message is the one line that the user gets to see. It ends the launch."""


@dataclass(frozen=True)
class SensorPlan:
    """The nodes of one sensor. frame: the sensor frame; params: parameter file of all; nodes: name -> parameters that go before those of
    the file; bag: that is recorded, '' for none; notes: what launch has to say about it."""

    frame: str
    namespace: str
    params: str
    nodes: Mapping[str, Mapping[str, object]]
    bag: str = ''
    notes: tuple[str, ...] = ()


def processes(plan: SensorPlan, composed: bool) -> list[Node]:
    """What starts the sensor: one process of all nodes, or one for each; a recorder is a process of its own, since a disk that is slow or
    full must not hold up a sensor, and is not started again, since its bag exists."""
    given = {'namespace': plan.namespace, 'output': 'screen', 'parameters': [plan.params, own_parameters(plan)], 'on_exit': end_if_wrong}
    again = {**given, 'respawn': True, 'respawn_delay': _RESPAWN_S}
    if composed:
        started = [Node(package='tactile_bringup', executable='sensor_nodes', exec_name=plan.frame, arguments=list(plan.nodes), **again)]
    else:
        started = [Node(package=NODES[name][0].partition('.')[0], executable=name, exec_name=f'{plan.frame}/{name}', **again)
                   for name in plan.nodes]
    if plan.bag:
        # It does not wait for somebody who works on raw data where that is in one process with the driver and is not seen.
        own = {'bag': plan.bag, **({'patience': 0.0} if composed else {})}
        given['parameters'] = [plan.params, own]
        started.append(Node(package='tactile_bringup', executable='record_node', **given))
    return started


def hand_frames(hand: str | Path) -> Node:
    """The process that publishes where the sensors of a hand are; hand: its file."""
    return Node(package='tactile_bringup', executable='hand_frames_node', output='screen', respawn=True, respawn_delay=_RESPAWN_S,
                parameters=[{'hand': str(Path(hand).expanduser().absolute())}], on_exit=end_if_wrong)


def end_if_wrong(event: ProcessExited, context: LaunchContext) -> None:
    """A parameter or file that is wrong ends the launch, anything else is no reason. Raises LaunchError: launch ends by it, and fails."""
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
