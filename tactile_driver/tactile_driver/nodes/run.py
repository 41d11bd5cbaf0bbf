# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Runs a node as a process: started by its entry point, ended cleanly by SIGINT or SIGTERM."""
from __future__ import annotations

from collections.abc import Callable

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


def run_node(make: Callable[[], Node], args: list[str] | None = None) -> int:
    """Spin the node that make() returns until it is interrupted; returns the exit code 0. The node's destroy_node() has to release what
    it holds."""
    node = None
    try:
        rclpy.init(args=args)
        node = make()
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0
