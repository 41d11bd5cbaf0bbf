# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Runs nodes as a process: started by its entry point, ended cleanly by SIGINT or SIGTERM."""
from __future__ import annotations

import faulthandler
import gc
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import rclpy
from rclpy._rclpy_pybind11 import RCLError
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions, install_signal_handlers, uninstall_signal_handlers
from rclpy.task import Future

from ..errors import TactileError
from .dead_ports import avoided
from .dead_segments import remove_segments
from .start import INTERRUPT

#: the exit code of a node that was given something wrong: started again, it would end again
WRONG = 2
#: s: a thread with a frame to publish must not wait Python's usual 5 ms for one that reads or renders the next.
_SWITCH_S = 5e-4
_SHUTDOWN_S = 1.0
#: s: Fast DDS may crash where a publisher is put away while others first hear of it: of 1087 nodes interrupted at their first message two
#: did, and none of 960 that had waited so long.
_MET_S = 1.0
#: s: launch kills after 10 what does not end; where nobody does, it must not stay for ever. A bag's index may take a while.
_HUNG_S = 15.0
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
    begun = time.monotonic()
    try:
        make_room_for_images()
        sys.setswitchinterval(_SWITCH_S)
        INTERRUPT.begin_making()
        remove_segments()
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)  # it would end amid the making, which shows in the log
        with avoided():
            for node in make():
                nodes.append(node)
        gc.freeze()  # what is there now stays: to look through all of it again takes a tenth of a second from some frame
        _spin(nodes)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except TactileError as error:
        get_logger('tactile').fatal(str(error))
        return WRONG
    except Exception:
        # What fails as rclpy ends is no news.
        if not INTERRUPT.asked:
            raise
    finally:
        _put_away(nodes, begun)
    return 0


def _put_away(nodes: list[Node], begun: float) -> None:
    """Destroy the nodes and end rclpy, where it has begun; says where it hangs, if it does, and ends all the same."""
    _be_deaf()
    if nodes:
        time.sleep(max(0.0, begun + _MET_S - time.monotonic()))
    faulthandler.dump_traceback_later(_HUNG_S, exit=True)
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown()
    gc.freeze()  # or the interpreter would look through all objects again and again before it ends
    faulthandler.cancel_dump_traceback_later()


def _be_deaf() -> None:
    """Ignore further interrupts: a second Ctrl-C, or launch's beside the terminal's, must not tear what is being put away."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)


class _Asked(Future):
    """Done when the process is asked to end. rclpy wakes what spins before it ends its context: the wake is lost where nobody looks for the
    signal itself, and the end comes with the next message or timer, or never."""

    def done(self) -> bool:
        """Whether there was a signal."""
        return INTERRUPT.asked


def _spin(nodes: list[Node]) -> None:
    executor = SingleThreadedExecutor()
    for node in nodes:
        executor.add_node(node)
    try:
        install_signal_handlers()
        INTERRUPT.begin_running()
        while not _spun(executor, nodes[0]):
            pass
    finally:
        uninstall_signal_handlers()  # waits for rclpy's thread, that uses what shutdown() takes away
        executor.shutdown(timeout_sec=_SHUTDOWN_S)


def _spun(executor: SingleThreadedExecutor, node: Node) -> bool:
    """Spin until the process is asked to end; False where it is not."""
    try:
        executor.spin_until_future_complete(_Asked())
        return True
    except RCLError as error:
        # rclpy lets this out when somebody asks for a transition that the state does not allow: no reason to end.
        if node.context.ok():
            node.get_logger().warning(f'a request was refused: {error}')
            return False
        return True
