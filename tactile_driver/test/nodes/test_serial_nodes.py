# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""psd_node and taxel_array_node as processes; ports and their faults: test/faults/test_serial_ports.py."""

import numpy as np
import pytest
from sensor_msgs.msg import Image
from tactile_driver.nodes.messages.conversions import instants
from tactile_msgs.msg import Contacts, PsdVoltages, Slip
from watching import Watcher, ended, stamps

pytestmark = [pytest.mark.ros, pytest.mark.full]


@pytest.fixture
def watch():
    """Makes a watcher of the node of that name."""
    made = []

    def begin(name):
        made.append(Watcher(name))
        return made[-1]
    yield begin
    for each in made:
        each.close()


def test_the_simulated_finger_comes_with_its_truth(watch, start):
    watcher = watch('psd_node')
    blocks, truths = watcher.collect(PsdVoltages, 'voltages', 100), watcher.collect(Contacts, 'ground_truth/contacts', 100)
    process = start('psd_node', scene='taps', rate=1000, batch_period=0.02)
    watcher.until(lambda: len(blocks) > 60 and any(t.contacts for t in truths))
    assert {len(b.voltages) for b in blocks} == {80} and {b.sample_period for b in blocks} == {1e-3}
    assert blocks[0].header.frame_id == 'psd_finger'
    assert len(set(stamps(blocks)) & set(stamps(truths))) > 30
    touch = next(t for t in truths if t.contacts).contacts[0]
    place = np.array([touch.position.x, touch.position.y, touch.position.z])
    assert np.linalg.norm(place) == pytest.approx(0.016)
    assert ended(process) == (0, '')


def test_the_simulated_array_comes_with_its_truth(watch, start):
    watcher = watch('taxel_array_node')
    images, truths = watcher.collect(Image, 'image_raw', 100), watcher.collect(Slip, 'ground_truth/slip', 100)
    process = start('taxel_array_node', scene='disc', rate=50)
    watcher.until(lambda: len(images) > 40 and len(truths) > 40)
    assert (images[0].height, images[0].width, images[0].encoding, images[0].header.frame_id) == (44, 44, 'mono8', 'taxel_array')
    assert len(set(stamps(images)) & set(stamps(truths))) > 30
    assert ended(process) == (0, '')


def test_a_file_in_another_order(watch, start, tmp_path):
    watcher = watch('taxel_array_node')
    np.save(tmp_path / 'a.npy', np.arange(6, dtype=np.uint16).reshape(1, 2, 3) * 1000)
    images = watcher.collect(Image, 'image_raw', 100)
    start('taxel_array_node', source='file', path=tmp_path / 'a.npy', rows=3, columns=2, transposed=True, flip_rows=True, loop=True,
          rate=20)
    watcher.until(lambda: len(images) > 3)
    values = np.frombuffer(images[0].data, np.uint16).reshape(3, 2)
    assert images[0].encoding == 'mono16' and values.tolist() == [[2000, 5000], [1000, 4000], [0, 3000]]


def test_truth_is_told_at_the_first_sample_and_where_it_changes():
    assert instants(np.array([0, 0, 1, 1, 2, 0])) == [0, 2, 4, 5]
    assert instants(np.array([1])) == [0]
