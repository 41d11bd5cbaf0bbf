# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The node as a user runs it: a process of its own, watched over ROS, on the emulator's pseudo-terminal and on the simulated finger."""
import subprocess
import sys
from functools import partial

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from tactile_msgs.msg import Contacts, PsdVoltages
from watching import ERROR, Watcher, ended, stamps

pytestmark = [pytest.mark.ros, pytest.mark.full]


@pytest.fixture
def watcher():
    watcher = Watcher('psd_node')
    yield watcher
    watcher.close()


@pytest.fixture
def finger(start):
    return partial(start, 'psd_node')


@pytest.fixture
def emulator(tmp_path):
    """The emulator as a process; its standard input takes faults."""
    process = subprocess.Popen([sys.executable, '-m', 'tactile_driver.emulators.psd', '--link', str(tmp_path / 'port'), '--rate', '1000'],
                               stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    process.stdout.readline()
    yield process
    process.kill()
    process.communicate()


def tell(emulator, fault):
    emulator.stdin.write(fault + '\n')
    emulator.stdin.flush()


def test_the_simulated_finger_comes_with_its_truth(watcher, finger):
    blocks, truths = watcher.collect(PsdVoltages, 'voltages', 100), watcher.collect(Contacts, 'ground_truth/contacts', 100)
    process = finger(scene='taps', rate=1000, batch_period=0.02)
    watcher.until(lambda: len(blocks) > 60 and any(t.contacts for t in truths))
    assert {len(b.voltages) for b in blocks} == {80} and {b.sample_period for b in blocks} == {1e-3}
    assert blocks[0].header.frame_id == 'psd_finger'
    assert len(set(stamps(blocks)) & set(stamps(truths))) > 30
    touch = next(t for t in truths if t.contacts).contacts[0]
    place = np.array([touch.position.x, touch.position.y, touch.position.z])
    assert np.linalg.norm(place) == pytest.approx(0.016)
    assert ended(process) == (0, '')


def test_a_serial_port_is_read_and_found_again(watcher, finger, emulator, tmp_path):
    blocks, reports = watcher.collect(PsdVoltages, 'voltages', 100), watcher.collect(DiagnosticArray, '/diagnostics', 10)
    finger(source='device', device=tmp_path / 'port', batch_period=0.01)
    watcher.until(lambda: len(blocks) > 20)
    tell(emulator, 'garbage')
    watcher.until(lambda: any(v.key == 'garbage bytes' and int(v.value) >= 300 for m in reports for s in m.status for v in s.values))
    tell(emulator, 'unplug')
    watcher.until(lambda: any(s.level == ERROR and 'port' in s.message for m in reports for s in m.status))
    seen = len(blocks)
    watcher.until(lambda: len(blocks) > seen + 20)
    assert (np.diff(stamps(blocks)) > 0).all()


def test_a_missing_port_is_told(watcher, finger):
    reports = watcher.collect(DiagnosticArray, '/diagnostics', 10)
    finger(source='device', device='no-such-serial')
    watcher.until(lambda: any(s.level == ERROR and 'no-such-serial' in s.message for m in reports for s in m.status))
    assert watcher.state() == 'unconfigured'
