# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Runs nodes as a process: started by its entry point, ended cleanly by SIGINT or SIGTERM."""
from __future__ import annotations

import gc
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import rclpy
from rclpy._rclpy_pybind11 import RCLError
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node

from ..errors import TactileError
from .dead_ports import avoided
from .start import INTERRUPT

#: the exit code of a node that was given something wrong: started again, it would end again
WRONG = 2
#: s: a thread with a frame to publish must not wait Python's usual 5 ms for one that reads or renders the next.
_SWITCH_S = 5e-4
_SHUTDOWN_S = 1.0
_PROFILE = Path(__file__).with_name('fastdds_profile.xml')
_PROFILE_NAMES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
_CHOSEN_BY = (*_PROFILE_NAMES, 'FASTDDS_BUILTIN_TRANSPORTS')


def make_room_for_images() -> None:
    """Give this process shared memory that holds images, unless the user has set up Fast DDS; call it before rclpy.init."""
    if not any(os.environ.get(name) for name in _CHOSEN_BY):
        os.environ.update(dict.fromkeys(_PROFILE_NAMES, str(_PROFILE)))


def run_node(make: Callable[[], Node], args: list[str] | None = None) -> int:
    """Spin the node that make() returns until it is interrupted; returns the exit code: 0, or WRONG where make() raises a TactileError.

    The node's destroy_node() has to release what it holds.
    """
    return run_nodes(lambda: iter([make()]), args)


def run_nodes(make: Callable[[], Iterator[Node]], args: list[str] | None = None) -> int:
    """The same for all nodes that make() yields, in one thread; they are put away in the same order."""
    nodes: list[Node] = []
    try:
        make_room_for_images()
        sys.setswitchinterval(_SWITCH_S)
        INTERRUPT.begin_making()
        rclpy.init(args=args)
        with avoided():
            for node in make():
                nodes.append(node)
        INTERRUPT.begin_running()
        gc.freeze()  # what is there now stays: to look through all of it again takes a tenth of a second from some frame
        _spin(nodes)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except TactileError as error:
        get_logger('tactile').fatal(str(error))
        return WRONG
    except Exception:
        # What is half made when rclpy ends fails in many ways, none of them news.
        if not INTERRUPT.asked:
            raise
    finally:
        _be_deaf()
        for node in nodes:
            node.destroy_node()
        rclpy.try_shutdown()
        _be_deaf()  # rclpy has put back what was there before it
        gc.freeze()  # or the interpreter would look through all objects again and again before it ends
    return 0


def _be_deaf() -> None:
    """Ignore further interrupts: a second Ctrl-C, or launch's beside the terminal's, must not tear what is being put away."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _spin(nodes: list[Node]) -> None:
    executor = SingleThreadedExecutor()
    for node in nodes:
        executor.add_node(node)
    try:
        while not _spun(executor, nodes[0]):
            pass
    finally:
        executor.shutdown(timeout_sec=_SHUTDOWN_S)


def _spun(executor: SingleThreadedExecutor, node: Node) -> bool:
    """Spin until rclpy has ended; False where it has not."""
    try:
        executor.spin()
        return True
    except RCLError as error:
        # rclpy lets this out when somebody asks for a transition that the state does not allow: no reason to end.
        if node.context.ok():
            node.get_logger().warning(f'a request was refused: {error}')
            return False
        return True
