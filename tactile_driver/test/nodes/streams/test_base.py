# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Raw data that had to wait in the driver, and what takers in the process are told of it."""
import time

import numpy as np
import pytest
import rclpy
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.taxel_array_node import TaxelArrayNode

BLOCKED_S = 0.3


@pytest.fixture
def ages():
    """ages(**parameters): how long ago, s, each of some images of a simulated array was sent, where the taker is blocked for a while."""
    rclpy.init()

    def of(**parameters):
        found, shared = [], {}

        def take(_message, sent_ns):
            found.append(1e-9 * (time.time_ns() - sent_ns))
            if len(found) == 10:
                time.sleep(BLOCKED_S)
        node = TaxelArrayNode(Host(parameters={'source': 'sim', 'autostart': False, 'rate': 100.0, **parameters}, shared=shared))
        shared[node.resolve_topic_name('image_raw')].attach(take)
        node.trigger_configure()
        node.trigger_activate()
        end = time.monotonic() + 20.0
        while len(found) < 60 and time.monotonic() < end:
            time.sleep(0.01)
        node.destroy_node()
        return found
    yield of
    rclpy.try_shutdown()


def test_of_a_live_source_takers_are_told_how_long_each_has_waited(ages):
    found = ages()
    assert found[10] > BLOCKED_S - 0.1 and found[20] > BLOCKED_S - 0.2 and len(found) >= 60


def test_of_a_recording_each_counts(ages, tmp_path):
    np.save(tmp_path / 'press.npy', np.zeros((100, 8, 8), np.uint16))
    assert max(ages(source='file', path=str(tmp_path / 'press.npy'), rows=8, columns=8, rate=0.0)) < BLOCKED_S - 0.1
