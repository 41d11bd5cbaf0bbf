# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""psd_node and taxel_array_node."""

import subprocess
import sys
from functools import partial

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import Image
from tactile_driver.nodes.messages.conversions import instants
from tactile_msgs.msg import Contacts, PsdVoltages, Slip
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


@pytest.fixture
def watcher_taxel():
    watcher_taxel = Watcher('taxel_array_node')
    yield watcher_taxel
    watcher_taxel.close()


@pytest.fixture
def array(start):
    return partial(start, 'taxel_array_node')


@pytest.fixture
def emulator_taxel(tmp_path):
    """The emulator_taxel as a process; its standard input takes faults."""
    command = [sys.executable, '-m', 'tactile_driver.emulators.taxel', '--link', str(tmp_path / 'port'), '--rate', '100']
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    process.stdout.readline()
    yield process
    process.kill()
    process.communicate()


def test_the_simulated_array_comes_with_its_truth(watcher_taxel, array):
    images, truths = watcher_taxel.collect(Image, 'image_raw', 100), watcher_taxel.collect(Slip, 'ground_truth/slip', 100)
    process = array(scene='disc', rate=50)
    watcher_taxel.until(lambda: len(images) > 40 and len(truths) > 40)
    assert (images[0].height, images[0].width, images[0].encoding, images[0].header.frame_id) == (44, 44, 'mono8', 'taxel_array')
    assert len(set(stamps(images)) & set(stamps(truths))) > 30
    assert ended(process) == (0, '')


def test_a_serial_port_is_read_and_found_again_taxel(watcher_taxel, array, emulator_taxel, tmp_path):
    images, reports = watcher_taxel.collect(Image, 'image_raw', 100), watcher_taxel.collect(DiagnosticArray, '/diagnostics', 10)
    array(source='device', device=tmp_path / 'port')
    watcher_taxel.until(lambda: len(images) > 20)
    emulator_taxel.stdin.write('unplug\n')
    emulator_taxel.stdin.flush()
    watcher_taxel.until(lambda: any(s.level == ERROR and 'port' in s.message for m in reports for s in m.status))
    seen = len(images)
    watcher_taxel.until(lambda: len(images) > seen + 20)
    assert (np.diff(stamps(images)) > 0).all()


def test_a_file_in_another_order(watcher_taxel, array, tmp_path):
    np.save(tmp_path / 'a.npy', np.arange(6, dtype=np.uint16).reshape(1, 2, 3) * 1000)
    images = watcher_taxel.collect(Image, 'image_raw', 100)
    array(source='file', path=tmp_path / 'a.npy', rows=3, columns=2, transposed=True, flip_rows=True, loop=True, rate=20)
    watcher_taxel.until(lambda: len(images) > 3)
    values = np.frombuffer(images[0].data, np.uint16).reshape(3, 2)
    assert images[0].encoding == 'mono16' and values.tolist() == [[2000, 5000], [1000, 4000], [0, 3000]]


def test_truth_is_told_at_the_first_sample_and_where_it_changes():
    assert instants(np.array([0, 0, 1, 1, 2, 0])) == [0, 2, 4, 5]
    assert instants(np.array([1])) == [0]
