# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The node as a user runs it: a process of its own, watched over ROS, on the emulator's pseudo-terminal, a file and the simulated array."""
import subprocess
import sys
from functools import partial

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import Image
from tactile_msgs.msg import Slip
from watching import ERROR, Watcher, ended, stamps

pytestmark = [pytest.mark.ros, pytest.mark.full]


@pytest.fixture
def watcher():
    watcher = Watcher('taxel_array_node')
    yield watcher
    watcher.close()


@pytest.fixture
def array(start):
    return partial(start, 'taxel_array_node')


@pytest.fixture
def emulator(tmp_path):
    """The emulator as a process; its standard input takes faults."""
    command = [sys.executable, '-m', 'tactile_driver.emulators.taxel', '--link', str(tmp_path / 'port'), '--rate', '100']
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    process.stdout.readline()
    yield process
    process.kill()
    process.communicate()


def test_the_simulated_array_comes_with_its_truth(watcher, array):
    images, truths = watcher.collect(Image, 'image_raw', 100), watcher.collect(Slip, 'ground_truth/slip', 100)
    process = array(scene='disc', rate=50)
    watcher.until(lambda: len(images) > 40 and len(truths) > 40)
    assert (images[0].height, images[0].width, images[0].encoding, images[0].header.frame_id) == (44, 44, 'mono8', 'taxel_array')
    assert len(set(stamps(images)) & set(stamps(truths))) > 30
    assert ended(process) == (0, '')


def test_a_serial_port_is_read_and_found_again(watcher, array, emulator, tmp_path):
    images, reports = watcher.collect(Image, 'image_raw', 100), watcher.collect(DiagnosticArray, '/diagnostics', 10)
    array(source='device', device=tmp_path / 'port')
    watcher.until(lambda: len(images) > 20)
    emulator.stdin.write('unplug\n')
    emulator.stdin.flush()
    watcher.until(lambda: any(s.level == ERROR and 'port' in s.message for m in reports for s in m.status))
    seen = len(images)
    watcher.until(lambda: len(images) > seen + 20)
    assert (np.diff(stamps(images)) > 0).all()


def test_a_file_in_another_order(watcher, array, tmp_path):
    np.save(tmp_path / 'a.npy', np.arange(6, dtype=np.uint16).reshape(1, 2, 3) * 1000)
    images = watcher.collect(Image, 'image_raw', 100)
    array(source='file', path=tmp_path / 'a.npy', rows=3, columns=2, transposed=True, flip_rows=True, loop=True, rate=20)
    watcher.until(lambda: len(images) > 3)
    values = np.frombuffer(images[0].data, np.uint16).reshape(3, 2)
    assert images[0].encoding == 'mono16' and values.tolist() == [[2000, 5000], [1000, 4000], [0, 3000]]
