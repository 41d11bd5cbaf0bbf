# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import signal
import subprocess
import sys
import time

import pytest
from tactile_driver.nodes.start import Interrupt

SLOW = 'import time\nprint("importing", flush=True)\ntime.sleep(60)\n'
MAIN = 'import sys, time\ndef main():\n    print("importing", flush=True)\n    time.sleep(60)\n'


def interrupted(folder, module, start, which):
    """(exit code, output) of a process that is told to end while it is at work in the module."""
    (folder / 'slow_module.py').write_text(module)
    code = f'import sys\nsys.path.insert(0, {str(folder)!r})\nfrom tactile_driver.nodes.start import {start}\n{start}("slow_module")'
    process = subprocess.Popen([sys.executable, '-c', code], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                               start_new_session=True)
    assert process.stdout.readline() == 'importing\n'
    time.sleep(0.05)
    process.send_signal(which)
    out, _ = process.communicate(timeout=20)
    return process.returncode, out


@pytest.mark.parametrize('which', [signal.SIGINT, signal.SIGTERM])
def test_a_node_that_still_imports_ends_quietly(tmp_path, which):
    assert interrupted(tmp_path, SLOW, 'start_node', which) == (0, '')


def test_a_tool_that_still_imports_ends_quietly(tmp_path):
    assert interrupted(tmp_path, SLOW, 'start_tool', signal.SIGINT) == (130, '')


def test_a_tool_at_work_ends_quietly(tmp_path):
    assert interrupted(tmp_path, MAIN, 'start_tool', signal.SIGINT) == (130, '')


@pytest.fixture
def handlers():
    """What the signals do is put back after the test."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize('which', [signal.SIGINT, signal.SIGTERM])
def test_what_comes_while_a_node_is_made_is_kept_until_it_runs(handlers, which):
    interrupt = Interrupt()
    interrupt.begin_making()
    signal.raise_signal(which)
    assert interrupt.asked
    with pytest.raises(KeyboardInterrupt):
        interrupt.begin_running()


@pytest.mark.parametrize('which', [signal.SIGINT, signal.SIGTERM])
def test_a_running_node_is_not_interrupted_wherever_it_is(which):
    interrupt = Interrupt()
    interrupt.begin_running()
    interrupt._on_signal(which, None)
    assert interrupt.asked
