# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Runs nodes as a process: init, spin, destroy, shutdown."""
from __future__ import annotations

import gc
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node

from ...errors import TactileError

#: exit code after a wrong argument: a restart would fail again
WRONG = 2
#: s, chosen: with Python's default of 5 ms a thread with a frame to publish waits for the one that reads or renders the next
_SWITCH_S = 5e-4
_ENDING_S = 0.1  # s, chosen: rclpy ends its context in another thread after a signal, within milliseconds
_PROFILE = Path(__file__).with_name('fastdds_profile.xml')
_PROFILE_NAMES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
_CHOSEN_BY = (*_PROFILE_NAMES, 'FASTDDS_BUILTIN_TRANSPORTS')


def make_room_for_images() -> None:
    """Configure Fast DDS with shared memory that holds images, unless the user has configured it; call this before rclpy.init."""
    if not any(os.environ.get(name) for name in _CHOSEN_BY):
        os.environ.update(dict.fromkeys(_PROFILE_NAMES, str(_PROFILE)))


def run_node(make: Callable[[], Node], args: list[str] | None = None) -> int:
    """Spin the node that make() returns until it is interrupted; the exit code: 0, or WRONG after a TactileError.

    The node's destroy_node() has to release its resources.
    """
    return run_nodes(lambda: iter([make()]), args)


def run_nodes(make: Callable[[], Iterator[Node]], args: list[str] | None = None) -> int:
    """As run_node for all nodes that make() yields, in one thread; they are destroyed in the same order."""
    nodes: list[Node] = []
    make_room_for_images()
    sys.setswitchinterval(_SWITCH_S)
    try:
        rclpy.init(args=args)
        for node in make():
            nodes.append(node)
        gc.freeze()  # a full collection over the start-up objects would delay a frame by 0.1 s (measured)
        _spin(nodes)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except TactileError as error:
        get_logger('tactile').fatal(str(error))
        return WRONG
    except Exception:
        if not _is_ending():
            raise
    finally:
        signal.signal(signal.SIGINT, lambda *_: None)  # a second SIGINT (terminal and launch) must not interrupt the cleanup
        for node in nodes:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _spin(nodes: list[Node]) -> None:
    executor = SingleThreadedExecutor()
    for node in nodes:
        executor.add_node(node)
    executor.spin()


def _is_ending() -> bool:
    """Whether ROS is shutting down; an executor may notice it before the context does."""
    time.sleep(_ENDING_S)
    return not rclpy.ok()
