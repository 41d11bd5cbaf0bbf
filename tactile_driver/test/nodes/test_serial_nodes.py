# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""psd_node and taxel_array_node as processes; ports and their faults: test/faults/test_serial_ports.py."""

import numpy as np
import pytest
from sensor_msgs.msg import Image
from tactile_driver.nodes.messages.conversions import instants
from watching import Watcher

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


def test_a_file_in_another_order(watch, start, tmp_path):
    watcher = watch('taxel_array_node')
    np.save(tmp_path / 'a.npy', np.arange(6, dtype=np.uint16).reshape(1, 2, 3) * 1000)
    images = watcher.collect(Image, 'image_raw', 100)
    start('taxel_array_node', source='file', path=tmp_path / 'a.npy', rows=3, columns=2, transposed=True, flip_rows=True, loop=True,
          rate=20)
    watcher.until(lambda: len(images) > 3)
    values = np.frombuffer(images[0].data, np.uint16).reshape(3, 2)
    assert images[0].encoding == 'mono16' and values.tolist() == [[2000, 5000], [1000, 4000], [0, 3000]]


def test_truth_is_reported_at_the_first_sample_and_where_it_changes():
    assert instants(np.array([0, 0, 1, 1, 2, 0])) == [0, 2, 4, 5]
    assert instants(np.array([1])) == [0]
