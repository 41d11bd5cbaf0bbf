# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Processes of nodes: signals, wrong arguments, timers."""

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress

import pytest
from rclpy.clock import ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from waiting import until

from tactile_driver.nodes.runtime import run
from tactile_driver.nodes.runtime.ros_defaults import steady_timer

PROGRAM = """
import sys
from rclpy.node import Node
from tactile_driver.nodes.runtime.run import process_of

class Quiet(Node):
    def __init__(self):
        super().__init__('quiet')
        print('up', flush=True)

    def destroy_node(self):
        print('released', flush=True)
        super().destroy_node()

process_of(Quiet)()
"""


def started(program):
    return subprocess.Popen([sys.executable, '-c', program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                            start_new_session=True)


_UP, _LAST = "print('up', flush=True)", "print('released', flush=True)"
_WORK = """self.timer = self.create_timer(0.05, self.work)

    def work(self):
        self.timer.cancel()
        print('working', flush=True); time.sleep(0.5); print('done', flush=True)"""


@pytest.mark.full
@pytest.mark.parametrize(('program', 'lines', 'signals', 'rest'), [
    (PROGRAM, ['up'], [signal.SIGTERM], 'released\n'),
    (PROGRAM.replace(_UP, _WORK), ['working'], [signal.SIGINT], 'done\nreleased\n'),
    (PROGRAM.replace(_LAST, f"print('putting away', flush=True); time.sleep(0.5); {_LAST}"), ['up', 'putting away'],
     [signal.SIGINT, signal.SIGINT], 'released\n')], ids=['at rest', 'at work', 'while it is put away'])
def test_signals_end_the_process_cleanly_and_interrupt_nothing(program, lines, signals, rest):
    process = started('import time' + program)
    for line, number in zip(lines, signals):
        assert process.stdout.readline() == line + '\n'
        process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (0, rest, '')


@pytest.mark.full
def test_a_library_that_hangs_when_the_interpreter_closes_down_does_not_hold_the_process():
    # As seen of a recorder whose bag was closed. launch sends a SIGINT of its own after that of the terminal.
    hanging = """
import atexit, threading
atexit.register(threading.Event().wait)
"""
    process = started(hanging + PROGRAM)
    assert process.stdout.readline() == 'up\n'
    process.send_signal(signal.SIGINT)
    assert process.stdout.readline() == 'released\n'
    with suppress(ProcessLookupError):
        process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (0, '', '')


@pytest.mark.full
@pytest.mark.parametrize(('error', 'code', 'traceback'), [("RuntimeError('no such thing')", 1, True),
                                                          ("BadArgument('path: no such thing')", run.EXIT_FAILURE, False)])
def test_an_exception_while_it_spins_ends_the_process_and_what_was_given_and_is_wrong_in_one_line(error, code, traceback):
    failing = PROGRAM.replace("print('up', flush=True)", f"""self.create_timer(0.05, self.fail)

    def fail(self):
        raise {error}""").replace('import sys', 'import sys\nfrom tactile_driver.errors import BadArgument')
    process = started(failing)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (code, 'released\n') and 'no such thing' in err and ('Traceback' in err) == traceback


@pytest.mark.parametrize('variable', run._CHOSEN_BY)
def test_a_users_own_fast_dds_set_up_is_left_alone(monkeypatch, variable):
    for name in run._CHOSEN_BY:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(variable, 'mine')
    run.make_room_for_images()
    assert {name: os.environ[name] for name in run._CHOSEN_BY if name in os.environ} == {variable: 'mine'}


def test_without_one_the_profile_is_used_and_exists(monkeypatch):
    for name in run._CHOSEN_BY:
        monkeypatch.setenv(name, '')
    run.make_room_for_images()
    assert os.path.isfile(os.environ['FASTRTPS_DEFAULT_PROFILES_FILE'])


def test_several_nodes_are_put_away_in_their_order_also_where_one_cannot_be_made(capfd, monkeypatch):
    from rclpy.node import Node

    from tactile_driver.errors import BadArgument
    monkeypatch.setattr(run, '_call_on_signals', lambda _end: None)
    gone = []

    class Named(Node):
        def destroy_node(self):
            gone.append(self.get_name())
            super().destroy_node()

    def make():
        yield Named('first')
        yield Named('second')
        raise BadArgument('third: its calibration is missing')
    assert run.run_nodes(make, []) == run.EXIT_FAILURE
    assert gone == ['first', 'second']
    assert 'third: its calibration is missing' in capfd.readouterr().err


def test_it_runs_where_simulated_time_stands_still(node):
    node.set_parameters([Parameter('use_sim_time', value=True)])
    calls = []
    timer = steady_timer(node, 0.01, lambda: calls.append(time.monotonic()))
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    assert until(lambda: len(calls) >= 3, executor)
    executor.shutdown()
    assert timer.clock.clock_type == ClockType.STEADY_TIME
