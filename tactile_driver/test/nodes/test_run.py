# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import os
import signal
import subprocess
import sys
import time

import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')

from tactile_driver.nodes import run  # noqa: E402

PROGRAM = """
import sys
from rclpy.node import Node
from tactile_driver.nodes.run import run_node

class Quiet(Node):
    def __init__(self):
        super().__init__('quiet')
        print('up', flush=True)

    def destroy_node(self):
        print('released', flush=True)
        super().destroy_node()

sys.exit(run_node(Quiet))
"""


def started(program):
    environment = {**os.environ, 'ROS_DOMAIN_ID': str(100 + os.getpid() % 100)}
    return subprocess.Popen([sys.executable, '-c', program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
                            start_new_session=True)


@pytest.mark.ros
@pytest.mark.parametrize('which', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_process_cleanly(which):
    process = started(PROGRAM)
    assert process.stdout.readline() == 'up\n'
    time.sleep(0.3)
    process.send_signal(which)
    out, err = process.communicate(timeout=20)
    assert (process.returncode, out, err) == (0, 'released\n', '')


@pytest.mark.ros
@pytest.mark.parametrize('which', ['SIGINT', 'SIGTERM'])
def test_a_signal_while_the_node_is_made_waits_until_it_is_whole(which):
    whole = PROGRAM.replace("super().__init__('quiet')", f"""os.kill(os.getpid(), signal.{which})
        super().__init__('quiet')
        self.create_publisher(Log, 'log', 1)""").replace('import sys', """import os, signal, sys
from rcl_interfaces.msg import Log""")
    process = started(whole)
    out, err = process.communicate(timeout=20)
    assert (process.returncode, out, err) == (0, 'up\nreleased\n', '')


@pytest.mark.ros
def test_further_interrupts_do_not_tear_what_is_put_away():
    last = "print('released', flush=True)"
    process = started('import time' + PROGRAM.replace(last, f"print('putting away', flush=True); time.sleep(0.5); {last}"))
    assert process.stdout.readline() == 'up\n'
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    assert process.stdout.readline() == 'putting away\n'
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=20)
    assert (process.returncode, out, err) == (0, 'released\n', '')


@pytest.mark.ros
def test_what_hangs_while_it_is_put_away_is_told_and_ends_all_the_same():
    hung = PROGRAM.replace('super().destroy_node()', 'threading.Event().wait()')
    process = started('import threading' + hung.replace('sys.exit', 'run_node.__globals__["_HUNG_S"] = 0.3\nsys.exit'))
    assert process.stdout.readline() == 'up\n'
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=20)
    assert (process.returncode, out) == (1, 'released\n') and 'in destroy_node' in err


@pytest.mark.parametrize('chosen', run._CHOSEN_BY)
def test_a_users_own_fast_dds_set_up_is_left_alone(monkeypatch, chosen):
    for name in run._CHOSEN_BY:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(chosen, 'mine')
    run.make_room_for_images()
    assert {name: os.environ[name] for name in run._CHOSEN_BY if name in os.environ} == {chosen: 'mine'}


def test_without_one_the_profile_is_used_and_exists(monkeypatch):
    for name in run._CHOSEN_BY:
        monkeypatch.setenv(name, '')
    run.make_room_for_images()
    assert os.path.isfile(os.environ['FASTRTPS_DEFAULT_PROFILES_FILE'])


@pytest.mark.ros
def test_several_nodes_are_put_away_in_their_order_also_where_one_cannot_be_made(capfd, monkeypatch):
    from rclpy.node import Node
    from tactile_driver.errors import BadArgument
    monkeypatch.setenv('ROS_DOMAIN_ID', str(100 + os.getpid() % 100))
    monkeypatch.setattr(run, '_be_deaf', lambda: None)
    monkeypatch.setattr(run.INTERRUPT, 'begin_making', lambda: None)
    gone = []

    class Named(Node):
        def destroy_node(self):
            gone.append(self.get_name())
            super().destroy_node()

    def make():
        yield Named('first')
        yield Named('second')
        raise BadArgument('third: its calibration is missing')
    assert run.run_nodes(make, []) == run.WRONG
    assert gone == ['first', 'second']
    assert 'third: its calibration is missing' in capfd.readouterr().err
