# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A reader's terminals: what runs until Ctrl-C runs beside the rest, which is waited for."""
import os
import re
import signal
import subprocess
import time
from pathlib import Path

_READY_S, _PATIENCE_S, _TOOL_S = 8.0, 60.0, 900.0
_LASTING = ('ros2 launch', 'python3 ')
#: Beginning of a command -> what it prints, besides ending with exit code 0; of one that runs until Ctrl-C, what it has printed by then.
#: A service that refuses, too, ends `ros2 service call` with exit code 0.
_RESULTS = {
    r'ros2 run tactile_bringup simulate': r': [1-9]\d* frames or samples of ',
    r'ros2 run tactile_bringup grasp_(table|poses|postures)': r'^\| [\w ]+ \| ',
    r'ros2 run tactile_bringup status': r'^/?\w+ +\w+_node ',
    r'ros2 run tactile_bringup hand_config': r'\.rviz$',
    r'ros2 run tactile_perception calibrate': r'^written: ',
    r'ros2 run tactile_perception process_bag': r': [1-9]\d* frames, .* written$',
    r'ros2 run tactile_perception evaluate': r'^[1-9]\d* instants compared',
    r'ros2 service call .*/get_state': r"label='active'",
    r'ros2 service call /\w+/calibrate_node/': r"message='\w",
    r'ros2 service call': r'success=True',
    r'ros2 topic echo': r'\w+[:=]',
    r'ros2 (node|topic) list': r'^/\w+',
    r'ros2 param get': r'value is: ',
    r'ros2 param set': r'[Ss]uccessful',
    r'ros2 launch .* record:=': r': [1-9]\d* messages recorded',
    r'python3 \S*slip_watch.py': r' slip, \d+ % of the contact',
}


def has_result(command: str, said: str) -> bool:
    """Whether what a command printed shows its result."""
    expected = next((result for beginning, result in _RESULTS.items() if re.match(beginning, command)), '')
    return re.search(expected, said, re.MULTILINE) is not None


def _succeeded(command: str, found: subprocess.CompletedProcess) -> bool:
    return found.returncode == 0 and has_result(command, found.stdout + found.stderr)


class Session:
    """A reader's terminals, all in one folder."""

    def __init__(self, folder: Path):
        self._folder = folder
        self._environment = {**os.environ, 'PYTHONUNBUFFERED': '1'}
        self._running: list[tuple[str, subprocess.Popen, Path]] = []
        self._count = 0

    def run(self, command: str) -> None:
        """One line. Raises AssertionError, with what was printed, where it fails."""
        if command.startswith(_LASTING) or ' run ' in command and ('_emulator' in command or '_node ' in command):
            self.begin(command)
        elif command.startswith('ros2 topic hz'):
            self._measure(command)
        elif command.startswith('ros2') and ' run ' not in command:
            self._ask(command)
        else:
            self._check(command, self.called(command, _TOOL_S))

    def called(self, command: str, limit: float) -> subprocess.CompletedProcess:
        return subprocess.run(['bash', '-c', command], cwd=self._folder, env=self._environment, capture_output=True, text=True,
                              timeout=limit)

    def _ask(self, command: str) -> None:
        """Again until the nodes are there: a busy machine takes long to start them."""
        end = time.monotonic() + _PATIENCE_S
        while not _succeeded(command, found := self.called(command, _PATIENCE_S)) and time.monotonic() < end:
            time.sleep(1.0)
        self._check(command, found)

    def _check(self, command: str, found: subprocess.CompletedProcess) -> None:
        assert _succeeded(command, found), f'{command}\n{found.stdout[-2000:]}\n{found.stderr[-2000:]}{self._said()}'

    def _start(self, command: str) -> tuple[subprocess.Popen, Path]:
        self._count += 1
        log = self._folder / f'{self._count}.log'
        with log.open('w') as out:
            process = subprocess.Popen(['bash', '-c', f'exec {command}'], cwd=self._folder, env=self._environment, stdin=subprocess.PIPE,
                                       stdout=out, stderr=subprocess.STDOUT, start_new_session=True)
        return process, log

    def begin(self, command: str) -> None:
        process, log = self._start(command)
        self._running.append((command, process, log))
        time.sleep(2.0 if '_emulator' in command else _READY_S)
        assert process.poll() is None, f'{command} has ended by itself\n{log.read_text()[-3000:]}'

    def _measure(self, command: str) -> None:
        process, log = self._start(command)
        end = time.monotonic() + _PATIENCE_S
        while 'average rate' not in log.read_text() and time.monotonic() < end:
            time.sleep(0.2)
        os.killpg(process.pid, signal.SIGINT)
        process.wait(20)
        assert 'average rate' in log.read_text(), f'{command} measured nothing{self._said()}'

    def end_block(self) -> None:
        """Ctrl-C for what still runs, the last first; it has to end cleanly, with its result and without a traceback."""
        ended, self._running = self._running[::-1], []
        failed = []
        for command, process, log in ended:
            os.killpg(process.pid, signal.SIGINT)
            try:
                code = process.wait(40)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                code = 'none'
            if code != 0 or 'Traceback' in log.read_text() or not has_result(command, log.read_text()):
                failed.append(f'{command}: exit code {code}\n{log.read_text()[-3000:]}')
        assert not failed, '\n'.join(failed)

    def _said(self) -> str:
        return ''.join(f'\n--- {command}\n{log.read_text()[-2000:]}' for command, _, log in self._running)
