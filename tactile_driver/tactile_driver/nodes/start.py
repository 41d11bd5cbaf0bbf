# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The beginning of a process: Ctrl-C while it still imports what it needs, which takes seconds, ends it without a word.

Entry points name functions of modules such as this one, that import nothing slow.
"""
from __future__ import annotations

import os
import signal
import sys
import threading
from importlib import import_module

INTERRUPTED = 130  # the exit code of a tool that was told to end before its work was done, as shells have it


class Interrupt:
    """What SIGINT and SIGTERM do: before `begin_making` they end the process, before `begin_running` they are kept; after it rclpy ends on
    either, and so does what spins. No exception is raised wherever the program happens to be: in a callback of the interpreter it would be
    lost, and leave its trace in the log."""

    def __init__(self):
        self.asked = False
        self._code: int | None = None

    def end_at_once(self, code: int) -> None:
        """From now on they end the process with this exit code; only the main thread can ask for it."""
        self._code = code
        self._listen()

    def begin_making(self) -> None:
        """Keep what comes: an exception amid the making of a node would leave half of it, or be lost."""
        self._code = None
        self._listen()

    def begin_running(self) -> None:
        """Raise KeyboardInterrupt for what was kept."""
        if self.asked:
            raise KeyboardInterrupt

    def _listen(self) -> None:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                signal.signal(number, self._on_signal)

    def _on_signal(self, _number: int, _frame: object) -> None:
        if self._code is not None:
            # An exception would come out of whatever is being imported, which may take it for something else.
            os._exit(self._code)
        self.asked = True


INTERRUPT = Interrupt()


def start_node(module: str) -> None:
    """Import the module and call its main(), which has to call run_node; interrupted before there is a node, exit code 0."""
    INTERRUPT.end_at_once(0)
    import_module(module).main()


def start_tool(module: str) -> None:
    """Import the module and exit with what its main() returns; 130 where it is interrupted."""
    INTERRUPT.end_at_once(INTERRUPTED)
    main = import_module(module).main
    for number, handler in ((signal.SIGINT, signal.default_int_handler), (signal.SIGTERM, signal.SIG_DFL)):
        signal.signal(number, handler)
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


def camera_node() -> None:
    """The process camera_node."""
    start_node('tactile_driver.nodes.camera_node')


def dual_camera_node() -> None:
    """The process dual_camera_node."""
    start_node('tactile_driver.nodes.dual_camera_node')


def psd_node() -> None:
    """The process psd_node."""
    start_node('tactile_driver.nodes.psd_node')


def psd_emulator() -> None:
    """The command psd_emulator."""
    start_tool('tactile_driver.emulator')


def taxel_array_node() -> None:
    """The process taxel_array_node."""
    start_node('tactile_driver.nodes.taxel_array_node')


def taxel_emulator() -> None:
    """The command taxel_emulator."""
    start_tool('tactile_driver.taxel_emulator')
