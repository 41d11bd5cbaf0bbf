# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fast starts of node processes: one process imports the modules and forks for each process started.

A child runs what its entry point runs, from the import of the node's module on; signals and exit codes are the node's own.
"""
from __future__ import annotations

import ctypes
import json
import os
import signal
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

MODULES = ('tactile_driver.nodes.psd_node', 'tactile_driver.nodes.camera_node', 'tactile_driver.nodes.taxel_array_node',
           'tactile_perception.node:psd_contact_node', 'tactile_perception.finger.stage', 'tactile_bringup.nodes.record_node')
_PERIOD_S = 0.02
_PDEATHSIG = 1  # PR_SET_PDEATHSIG, from linux/prctl.h


class Process:
    """A process forked by the zygote; its output is gathered in log."""

    def __init__(self, zygote: Zygote, pid: int, path: Path):
        self._zygote, self.pid, self._path, self.code = zygote, pid, path, None

    @property
    def log(self) -> str:
        return self._path.read_text(errors='replace')

    def poll(self) -> int | None:
        """The exit code, negative for a signal; None while it runs."""
        if self.code is None:
            self.code = self._zygote.ask(poll=self.pid)
        return self.code

    def send(self, number: int) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)

    def wait(self, seconds: float = 60.0) -> int:
        """The exit code once it has ended."""
        end = time.monotonic() + seconds
        while self.poll() is None:
            assert time.monotonic() < end, f'still running: {self.log}'
            time.sleep(_PERIOD_S)
        return self.code


class Zygote:
    """The process that forks; folder: for their logs."""

    def __init__(self, folder: Path):
        self._folder, self._count = folder, 0
        environment = {**os.environ, 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST', 'OMP_NUM_THREADS': '1'}
        self._process = subprocess.Popen([sys.executable, __file__, *MODULES], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                                         env=environment, cwd=folder, start_new_session=True)

    def ask(self, **what):
        """The zygote's answer."""
        self._process.stdin.write(json.dumps(what) + '\n')
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline())

    def start(self, module: str, namespace: str, **parameters) -> Process:
        """The process of a node under a namespace, with parameters; module: that of its main(), and :name of the command where several
        have that module."""
        self._count += 1
        path = self._folder / f'{module.rpartition(".")[2].rpartition(":")[2]}_{self._count}.log'
        given = [word for name, value in parameters.items() for word in ('-p', f'{name}:={value}')]
        return Process(self, self.ask(start=module, log=str(path), words=['--ros-args', '-r', f'__ns:={namespace}', *given]), path)

    def close(self) -> None:
        self._process.stdin.close()
        self._process.wait(timeout=20)


def _polled(pid: int) -> int | None:
    found, status = os.waitpid(pid, os.WNOHANG)
    return os.waitstatus_to_exitcode(status) if found else None


def _become(module: str, log: str, words: list[str]) -> None:
    """What a process that was started anew would be at this point."""
    os.setsid()
    ctypes.CDLL(None).prctl(_PDEATHSIG, signal.SIGKILL)  # no process survives if the tests end early
    for number, path, flags in ((0, os.devnull, os.O_RDONLY), (1, log, os.O_WRONLY | os.O_CREAT), (2, log, os.O_WRONLY | os.O_APPEND)):
        os.dup2(os.open(path, flags, 0o644), number)
    module, _, name = module.partition(':')
    sys.argv = [name or module, *words]
    try:
        import_module(module).main()
    except SystemExit as end:
        # not exit(): LTTng, a dependency of rclpy, would cancel threads there that only the forking process has
        sys.stderr.flush()
        os._exit(end.code)


def main() -> None:
    for module in sys.argv[1:]:
        import_module(module.partition(':')[0])
    while line := sys.stdin.readline():
        asked = json.loads(line)
        if 'poll' in asked:
            answer = _polled(asked['poll'])
        else:
            answer = os.fork()
            if not answer:
                return _become(asked['start'], asked['log'], asked['words'])
        print(json.dumps(answer), flush=True)


if __name__ == '__main__':
    main()
