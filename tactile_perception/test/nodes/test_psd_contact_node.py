# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The node over ROS: contacts under the samples' stamps, no work without subscribers, reference on request."""
import os
import time

import numpy as np
import pytest

rclpy = pytest.importorskip('rclpy')
os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from tactile_driver.nodes.messages.conversions import voltages_message  # noqa: E402
from tactile_driver.samples import SampleBlock  # noqa: E402
from tactile_driver.simulation.psd.scene import open_psd_scene  # noqa: E402
from tactile_msgs.msg import Contacts, PsdVoltages  # noqa: E402

from tactile_perception.node import make_node  # noqa: E402

pytestmark = pytest.mark.ros
BATCH = 10


@pytest.fixture(scope='module')
def blocks():
    counts, _ = open_psd_scene('taps', 1000.0).play(0, 700)
    volts = (counts * (5 / 4096)).astype(np.float32)
    return [voltages_message(SampleBlock(volts[k:k + BATCH], 10**9 + k * 1_000_000, 1e-3), 'finger') for k in range(0, 700, BATCH)]


@pytest.fixture
def bench():
    rclpy.init()
    node, helper = make_node('psd_contact_node'), rclpy.create_node('helper')
    executor = SingleThreadedExecutor()
    executor.add_node(node), executor.add_node(helper)
    publisher = helper.create_publisher(PsdVoltages, 'voltages', 200)

    def until(condition, seconds=10.0):
        end = time.monotonic() + seconds
        while not condition() and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.02)
        assert condition()
    yield node, helper, publisher, until
    executor.shutdown()  # or it may hold the nodes' subscriptions
    node.destroy_node(), helper.destroy_node()
    rclpy.try_shutdown()


def test_contacts_come_while_subscribed_and_the_reference_on_request(bench, blocks):
    node, helper, publisher, until = bench
    assert publisher.get_subscription_count() == 0
    heard = []
    helper.create_subscription(Contacts, 'contacts', heard.append, 100)
    until(lambda: publisher.get_subscription_count() == 1)
    for block in blocks:
        publisher.publish(block)
    until(lambda: len(heard) >= 51)
    stamps = [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in heard]
    assert stamps == sorted(set(stamps)) and heard[0].header.frame_id == 'finger'
    assert any(m.contacts for m in heard)
    assert node.stage.finger.ready
    client = helper.create_client(Trigger, 'set_reference')
    future = client.call_async(Trigger.Request())
    until(future.done)
    assert future.result().success and not node.stage.finger.ready


def test_without_voltages_there_is_no_reference_to_take(bench):
    node, helper, _, until = bench
    client = helper.create_client(Trigger, 'set_reference')
    future = client.call_async(Trigger.Request())
    until(future.done)
    assert not future.result().success and 'voltages' in future.result().message
