# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""finger_markers_node draws for those who look, and nothing for nobody."""
import time

import pytest

rclpy = pytest.importorskip('rclpy')
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile  # noqa: E402
from tactile_msgs.msg import Contacts  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402
from visualization_msgs.msg import MarkerArray  # noqa: E402

from tactile_bringup.nodes.finger_markers_node import FingerMarkersNode  # noqa: E402

pytestmark = pytest.mark.ros


@pytest.fixture
def bench():
    rclpy.init(domain_id=65)
    node, other, executor = FingerMarkersNode(), rclpy.create_node('other'), SingleThreadedExecutor()
    executor.add_node(node), executor.add_node(other)

    def until(condition, seconds=15.0):
        end = time.monotonic() + seconds
        while not condition() and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.05)
        return condition()
    yield other, until
    executor.shutdown()
    node.destroy_node(), other.destroy_node()
    rclpy.try_shutdown()


def test_markers_for_somebody_and_the_tip_for_all(bench):
    other, until = bench
    contacts = other.create_publisher(Contacts, 'contacts', 10)
    places, drawn = [], []
    other.create_subscription(TFMessage, '/tf_static', places.append, QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    assert until(lambda: places)
    tip = places[0].transforms[0]
    assert (tip.header.frame_id, tip.child_frame_id, tip.transform.translation.z) == ('psd_finger', 'psd_finger_tip', 0.016)
    assert contacts.get_subscription_count() == 0
    other.create_subscription(MarkerArray, 'markers', drawn.append, 10)
    assert until(lambda: contacts.get_subscription_count() == 1)
    message = Contacts()
    message.header.frame_id, message.header.stamp.sec = 'psd_finger', 7
    contacts.publish(message)
    assert until(lambda: drawn)
    assert drawn[0].markers[0].ns == 'finger' and drawn[0].markers[0].header.stamp.sec == 7
