# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Runs nodes as a process: init, spin, destroy, shutdown, exit."""
from __future__ import annotations

import ctypes
import faulthandler
import gc
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NoReturn

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from ...errors import TactileError
from ..constants import NODES

#: exit code after a wrong argument: a restart would fail again
EXIT_FAILURE = 2
#: options of glibc's malloc (malloc.h): a block from 2 MB on, such as a table of a model or what is computed with at the start, goes back
#: to the system when it is freed; pictures stay in the heap, whose free end is kept up to twice that; all threads share one heap. By
#: default the limit rises to the largest block that was ever freed: a touchpad's process keeps 14 MB more, for no time saved
_MALLOPT = {-3: 2 << 20, -1: 4 << 20, -8: 1}  # M_MMAP_THRESHOLD, M_TRIM_THRESHOLD, M_ARENA_MAX
#: what the types of messages import beside what they need, if it is there: the generator of their code and its parser, 3 MB
_GENERATOR = 'rosidl_generator_py.generate_py_impl'
_PROFILE = Path(__file__).with_name('fastdds_profile.xml')
_PROFILE_NAMES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
_CHOSEN_BY = (*_PROFILE_NAMES, 'FASTDDS_BUILTIN_TRANSPORTS')


def make_room_for_images() -> None:
    """Configure Fast DDS with shared memory that holds images, unless the user has configured it; call this before rclpy.init."""
    if not any(os.environ.get(name) for name in _CHOSEN_BY):
        os.environ.update(dict.fromkeys(_PROFILE_NAMES, str(_PROFILE)))


def run_node(make: Callable[[], Node], args: list[str] | None = None) -> int:
    """Spin the node that make() returns until SIGINT or SIGTERM; the exit code: 0, or EXIT_FAILURE after a TactileError.

    The node's destroy_node() has to release its resources.
    """
    return run_nodes(lambda: iter([make()]), args)


def process_of(make: Callable[[], Node]) -> Callable[..., None]:
    """The main function of a process that runs the node that make() returns."""
    return lambda args=None: exit_process(lambda: run_node(make, args))


def exit_process(run: Callable[[], int]) -> NoReturn:
    """End this process with the exit code that run() returns, 1 after an exception.

    The interpreter is not closed down: run_nodes has released all that the nodes had, and closing down may hang in a thread or in a
    library (seen: a recorder whose bag was closed), where signals no longer end the process.
    """
    try:
        code = run()
    except Exception:
        traceback.print_exc()
        code = 1
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):  # who read it has ended
            stream.flush()
    os._exit(code)


def run_nodes(make: Callable[[], Iterator[Node]], args: list[str] | None = None) -> int:
    """As run_node for all nodes that make() yields, in one thread; they are destroyed in the same order."""
    nodes: list[Node] = []
    make_room_for_images()
    _give_memory_back()
    sys.modules.setdefault(_GENERATOR, None)  # makes its import fail
    sys.setswitchinterval(NODES.switch_s)
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    executor, ended = SingleThreadedExecutor(), threading.Event()
    _call_on_signals(lambda: executor.create_task(ended.set))
    try:
        for node in make():
            nodes.append(node)
            executor.add_node(node)
        gc.freeze()  # a full collection over the start-up objects would delay a frame by 0.1 s (measured)
        while not ended.is_set():
            executor.spin_once()
    except KeyboardInterrupt:  # a node that ends itself
        pass
    except TactileError as error:
        get_logger('tactile').fatal(str(error))
        return EXIT_FAILURE
    finally:
        for node in nodes:
            node.destroy_node()
        with ends_within(NODES.max_close_s):
            rclpy.try_shutdown()
    return 0


def _give_memory_back() -> None:
    """Set _MALLOPT where the C library is glibc."""
    mallopt = getattr(ctypes.CDLL(None), 'mallopt', None)
    for option, value in _MALLOPT.items() if mallopt is not None else ():
        mallopt(option, value)


@contextmanager
def ends_within(seconds: float) -> Iterator[None]:
    """What is done meanwhile may take so many s; the process then says where each thread hangs and exits with code 1. It replaces an
    earlier limit."""
    faulthandler.dump_traceback_later(seconds, exit=True, file=sys.__stderr__)
    try:
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()


def _call_on_signals(end: Callable[[], None]) -> None:
    """Call end() in another thread at the first SIGINT or SIGTERM; later ones do nothing.

    rclpy's own handler wakes executors in a thread of its own, which crashes when this thread meanwhile puts its executor away; it
    also ends the context and interrupts Python amid whatever a node does. Here a node ends its work first.
    """
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: None)

    def wait() -> None:
        """Wait for the first signal."""
        if os.read(reading, 1):
            faulthandler.dump_traceback_later(NODES.max_end_s, exit=True, file=sys.__stderr__)
            end()

    threading.Thread(target=wait, daemon=True).start()
