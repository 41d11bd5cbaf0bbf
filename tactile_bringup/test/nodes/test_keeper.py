# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What keeps the processes of a hand alive: with processes that do nothing, or what a test wants."""
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')

import psutil  # noqa: E402
from tactile_driver.errors import BadArgument  # noqa: E402
from tactile_driver.nodes.run import WRONG  # noqa: E402

from tactile_bringup.nodes.keeper import groups_of  # noqa: E402

pytestmark = pytest.mark.ros
PROGRAM = """
import os, signal, sys, time
from tactile_bringup.nodes.keeper import Keeper

def sleeper():
    signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    os.write(1, b'up\\n')  # at once: print's pieces would mix with those of the other
    time.sleep(60)

def run():
    try:
        sleeper()
    except SystemExit as end:
        return end.code

sys.exit(Keeper({'first': run, 'second': OTHER}).keep())
"""


class Kept:
    """A keeper as a process, and what it and its processes say."""

    def __init__(self, other='run'):
        program = PROGRAM.replace('OTHER', other)
        self.process = subprocess.Popen([sys.executable, '-c', program], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                        start_new_session=True)

    def children(self, count):
        """Name -> process, once there are so many."""
        end = time.monotonic() + 20
        while time.monotonic() < end:
            found = {child.name(): child for child in psutil.Process(self.process.pid).children()}
            if len(found) == count and set(found) <= {'first', 'second'}:
                return found
            time.sleep(0.01)
        raise AssertionError('they are not there')

    def hear(self, *parts):
        """The next line with all the parts."""
        return next(line for line in self.process.stdout if all(part in line for part in parts))

    def end(self, number=signal.SIGINT):
        self.process.send_signal(number)
        return self.process.wait(timeout=20)


@pytest.fixture
def keep():
    made = []

    def start(*args):
        made.append(Kept(*args))
        return made[-1]
    yield start
    for kept in made:
        kept.process.kill()
        kept.process.wait()
        kept.process.stdout.close()


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_what_is_asked_to_end_ends_what_it_keeps(keep, number):
    kept = keep()
    for _ in range(2):
        kept.hear('up')
    found = kept.children(2)
    assert kept.end(number) == 0
    assert not any(child.is_running() for child in found.values())


def test_what_dies_is_there_again_and_the_other_goes_on(keep):
    kept = keep()
    for _ in range(2):
        kept.hear('up')
    before = kept.children(2)
    before['first'].kill()
    kept.hear('first has ended with -9; it is started again')
    kept.hear('up')
    after = kept.children(2)
    assert after['second'].pid == before['second'].pid and after['first'].pid != before['first'].pid
    assert kept.end() == 0


def test_what_was_given_something_wrong_ends_all(keep):
    kept = keep(f'lambda: {WRONG}')
    kept.hear('second: what it was given is wrong, see above')
    assert kept.process.wait(timeout=20) == WRONG


def test_what_fails_at_once_is_not_tried_without_end(keep):
    kept = keep('lambda: 1 / 0')
    begin = time.monotonic()
    for _ in range(3):
        kept.hear('second has ended with 1; it is started again')
    assert time.monotonic() - begin > 0.9, 'two pauses'
    assert kept.end() == 0


def test_nobody_outlives_a_keeper_that_is_killed(keep):
    kept = keep()
    for _ in range(2):
        kept.hear('up')
    found = kept.children(2)
    kept.process.kill()
    assert psutil.wait_procs(found.values(), timeout=10)[1] == []


def test_groups_are_read():
    node = {'node': 'psd_node', 'namespace': '/tip'}
    assert [plan.node for plan in groups_of(json.dumps({'tip': [node]}))['tip']] == ['psd_node']
    for text, told in (('[', 'cannot be read'), ('3', 'cannot be read'), ('{}', 'no process is named'), ('{"tip": []}', 'is empty')):
        with pytest.raises(BadArgument, match=told):
            groups_of(text)


def test_a_wrong_text_ends_it_with_one_line():
    program = Path(sys.executable).with_name('hand_node')
    command = [str(program)] if program.exists() else [sys.executable, '-m', 'tactile_bringup.nodes.keeper']
    found = subprocess.run([*command, '[]'], capture_output=True, text=True, cwd=os.path.expanduser('~'))
    assert found.returncode == WRONG and 'cannot be read' in found.stderr and 'Traceback' not in found.stderr
