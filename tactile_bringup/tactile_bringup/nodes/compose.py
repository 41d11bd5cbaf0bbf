# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""sensor_nodes: several nodes of one sensor in one process, images and results going from one to the next by a call.

    ros2 run tactile_bringup sensor_nodes camera_node dot_tracker_node --ros-args -r __ns:=/thumb --params-file pad.yaml
"""
from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from importlib import import_module
from threading import RLock

from rclpy.node import Node
from rclpy.utilities import remove_ros_args
from tactile_driver.errors import BadArgument
from tactile_driver.nodes.runtime.host import Host, SharedPublisher
from tactile_driver.nodes.runtime.run import run_nodes

from ..sensor_types import NODES


def kind_of(name: str) -> type:
    """The class of the node of this name; its module, with all that it needs, is imported where it is not yet."""
    package, kind = NODES[name]
    return getattr(import_module(f'{package}.{name}'), kind)


def made(names: Sequence[str]) -> Iterator[Node]:
    """Make the nodes, in this order: whoever takes messages by a call comes after who publishes them. Raises TactileError."""
    for name in names:
        if name not in NODES:
            raise BadArgument(f'node {name!r} is unknown; known are {", ".join(NODES)}')
    if not names:
        raise BadArgument(f'no node is named; name one or more of {", ".join(NODES)}')
    # Nodes of one sensor, which work one after the other in one thread, share a lock: with one each they could wait for each other.
    shared: dict[str, SharedPublisher] = {}
    lock = RLock()
    for name in names:
        yield kind_of(name)(Host(shared=shared, lock=lock))


def main(args: list[str] | None = None) -> None:
    """The process sensor_nodes."""
    names = remove_ros_args(args)[1:]
    sys.exit(run_nodes(lambda: made(names), args))


if __name__ == '__main__':
    main()
