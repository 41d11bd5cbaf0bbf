# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""sensor_nodes: runs several nodes of one sensor in one process; images and results pass from node to node by function calls.

    ros2 run tactile_bringup sensor_nodes camera_node touchpad_contact_node --ros-args -r __ns:=/thumb --params-file pad.yaml
"""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib.metadata import distribution
from threading import RLock

from rclpy.node import Node
from rclpy.utilities import remove_ros_args

from tactile_driver.errors import BadArgument
from tactile_driver.nodes.runtime.host import Host, SharedPublisher
from tactile_driver.nodes.runtime.run import exit_process, run_nodes
from tactile_perception.core.node import make_node
from tactile_perception.core.sensor_type import NODES


def made(names: Sequence[str]) -> Iterator[Node]:
    """Make the nodes in this order, publishers before the nodes that receive their messages by calls. Raises TactileError."""
    # The nodes of this package are known without the entry points of all packages, which delay the start.
    NODES.update((entry.name, entry.value) for entry in distribution('tactile_bringup').entry_points if entry.group == NODES.group)
    for name in names:
        if name not in NODES:
            raise BadArgument(f'node {name!r} is unknown; known are {", ".join(NODES)}')
    if not names:
        raise BadArgument(f'no node is named; name one or more of {", ".join(NODES)}')
    # The nodes call each other in one thread and share a reentrant lock, because separate locks could deadlock.
    shared: dict[str, SharedPublisher] = {}
    lock = RLock()
    for name in names:
        yield make_node(name, Host(shared=shared, lock=lock))


def main(args: list[str] | None = None) -> None:
    """Run the process sensor_nodes."""
    names = remove_ros_args(args)[1:]
    exit_process(lambda: run_nodes(lambda: made(names), args))
