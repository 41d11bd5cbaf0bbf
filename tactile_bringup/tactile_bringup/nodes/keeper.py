# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""hand_node: the processes of a hand, forked from one that has imported what they need, and forked again when they die.

    hand_node '{"thumb": [{"node": "camera_node", "namespace": "/thumb", "parameters": {"source": "sim"}},
                          {"node": "dot_tracker_node", "namespace": "/thumb", "params_file": "pad.yaml"}], "tip": [...]}'

Each name is a process, with its nodes. Imports take a second or two of a core, once for the whole hand, and a sensor that dies does not
wait for them again. This process joins nothing of ROS itself, since what has threads cannot be forked.
"""
from __future__ import annotations

import ctypes
import gc
import json
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable

from rclpy.logging import get_logger
from tactile_driver.errors import BadArgument, TactileError
from tactile_driver.nodes.run import WRONG, run_nodes

from .compose import Plan, kind_of, made, plans_of

_SIGNALS = {signal.SIGCHLD, signal.SIGINT, signal.SIGTERM}
_PAUSE_S = 0.5  # before the next start of what lived for less than _SHORT_S: it may die again
_SHORT_S = 5.0
_SET_NAME, _SET_DEATH_SIGNAL = 15, 1  # of linux/prctl.h


def groups_of(text: str) -> dict[str, list[Plan]]:
    """The processes that a JSON text names, with their nodes. Raises BadArgument."""
    try:
        groups = {str(name): plans_of(plans) for name, plans in json.loads(text).items()}
    except (ValueError, AttributeError) as error:
        raise BadArgument(f'hand_node: the processes cannot be read: {error}') from error
    if not groups:
        raise BadArgument('hand_node: no process is named; name one or more')
    return groups


class Keeper:
    """Runs processes until a signal asks it to end; run: name -> what a process runs, which returns its exit code."""

    def __init__(self, run: dict[str, Callable[[], int]]):
        self._run = run
        self._names: dict[int, str] = {}
        self._begun: dict[str, float] = {}
        self._due: dict[str, float] = dict.fromkeys(run, 0.0)
        self._code, self._closing = 0, False
        self._log = get_logger('hand')

    def keep(self) -> int:
        """Start them and see to it that they run; the exit code: WRONG where one was given something wrong, 1 where one failed to end
        cleanly when it was asked to, else 0."""
        before = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
        while self._names or not self._closing:
            for name in [name for name, due in self._due.items() if due <= time.monotonic()]:
                self._start(name, before)
            self._wait()
            self._gather()
        return self._code

    def _start(self, name: str, before: set[signal.Signals]) -> None:
        del self._due[name]
        self._begun[name] = time.monotonic()
        keeper, pid = os.getpid(), os.fork()
        if pid == 0:
            _become(name, keeper, before, self._run[name])
        self._names[pid] = name

    def _wait(self) -> None:
        """For a signal, or the next start; one that asks for the end is passed on."""
        if self._due:
            told = signal.sigtimedwait(_SIGNALS, max(min(self._due.values()) - time.monotonic(), 0.0))
        else:
            told = signal.sigwaitinfo(_SIGNALS)
        if told is not None and told.si_signo != signal.SIGCHLD:
            self._close(told.si_signo)

    def _close(self, number: int) -> None:
        self._closing, self._due = True, {}
        for pid in self._names:
            os.kill(pid, number)

    def _gather(self) -> None:
        """Those that have ended."""
        for pid in list(self._names):
            ended, status = os.waitpid(pid, os.WNOHANG)
            if ended:
                self._ended(self._names.pop(pid), os.waitstatus_to_exitcode(status))

    def _ended(self, name: str, code: int) -> None:
        if code == WRONG:
            self._log.error(f'{name}: what it was given is wrong, see above')
            self._code = WRONG
            self._close(signal.SIGINT)
        elif self._closing:
            self._code = self._code or int(code != 0)
        else:
            self._log.warning(f'{name} has ended with {code}; it is started again')
            short = time.monotonic() - self._begun[name] < _SHORT_S
            self._due[name] = time.monotonic() + (_PAUSE_S if short else 0.0)


def _become(name: str, keeper: int, before: set[signal.Signals], run: Callable[[], int]) -> None:
    """Be the process of this name: it ends with what run returns, or with its keeper; nobody else would end it, or free its device."""
    system = ctypes.CDLL(None)
    system.prctl(_SET_NAME, name.encode()[:15], 0, 0, 0)
    system.prctl(_SET_DEATH_SIGNAL, signal.SIGKILL, 0, 0, 0)
    code = 1
    try:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if os.getppid() == keeper:
            code = run()
    except BaseException:  # nothing may come back to what the keeper does
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def main(args: list[str] | None = None) -> None:
    """The process hand_node."""
    words = (args or sys.argv)[1:2]
    try:
        groups = groups_of(*words or ['{}'])
    except TactileError as error:
        get_logger('tactile').fatal(str(error))
        sys.exit(WRONG)
    for plan in (plan for plans in groups.values() for plan in plans):
        kind_of(plan)
    gc.freeze()  # what the processes share stays shared: the garbage collector would write to all of it
    sys.exit(Keeper({name: lambda plans=plans: run_nodes(lambda: made(plans), args) for name, plans in groups.items()}).keep())


if __name__ == '__main__':
    main()
