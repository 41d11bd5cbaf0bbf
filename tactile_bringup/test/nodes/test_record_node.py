# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""record_node writes what it receives as it was sent, and never over a recording that exists."""
import time

import pytest

rclpy = pytest.importorskip('rclpy')
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy  # noqa: E402
from rosbags.interfaces import QosDurability, QosReliability  # noqa: E402
from rosbags.rosbag2 import Reader  # noqa: E402
from sensor_msgs.msg import Image  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from tactile_bringup.nodes.record_node import RecordNode  # noqa: E402
from tactile_driver.errors import TactileError  # noqa: E402
from tactile_msgs.msg import DotTracks  # noqa: E402
from tactile_perception.bags.rosbag import BagReader  # noqa: E402
from tactile_perception.nodes.messages.serialization import MessageCodec  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402

pytestmark = pytest.mark.ros


def recorder(**values):
    arguments = [word for name, value in values.items() for word in ('-p', f'{name}:={value}')]
    rclpy.init(args=['--ros-args', *arguments])
    return RecordNode()


def test_messages_are_written_as_they_were_sent(tmp_path):
    node = recorder(bag=tmp_path / 'bag')
    sender, executor = rclpy.create_node('sender'), SingleThreadedExecutor()
    executor.add_node(node)
    outputs = sender.create_publisher(DotTracks, 'dots', 10), sender.create_publisher(Image, 'image_raw', 10)
    listener = sender.create_subscription(Image, 'image_raw', lambda _message: None, 10)
    sent = DotTracks(rows=2, columns=3, id=[1, 5], u=[1.5, 2.5])
    end = time.monotonic() + 20
    heard = 0
    while heard < 6 and time.monotonic() < end:
        heard += outputs[1].get_subscription_count() == 2  # the recorder too: it takes raw data after those who work on it
        outputs[0].publish(sent)
        outputs[1].publish(Image(height=1, width=2, encoding='mono8', step=2, data=[7, 8]))
        executor.spin_once(timeout_sec=0.05)
    written = node.written
    executor.shutdown()
    node.destroy_node()
    sender.destroy_subscription(listener)
    sender.destroy_node()
    rclpy.shutdown()
    codec = MessageCodec()
    with BagReader(tmp_path / 'bag') as bag:
        messages = list(bag.messages())
        assert bag.topics['/image_raw'] == 'sensor_msgs/msg/Image'
    assert len(messages) == written >= 6
    assert all(codec.decode(m.data, m.type_name) == sent for m in messages if m.topic == '/dots')
    assert {bytes(codec.decode(m.data, m.type_name).data) for m in messages if m.topic == '/image_raw'} == {bytes([7, 8])}


def test_the_bag_carries_what_was_offered_and_what_was_latched_before(tmp_path):
    best_effort, latched = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT), DurabilityPolicy.TRANSIENT_LOCAL
    node = recorder(bag=tmp_path / 'bag', patience=0.0)
    sender, executor = rclpy.create_node('sender'), SingleThreadedExecutor()
    executor.add_node(node)
    said = sender.create_publisher(String, 'description', QoSProfile(depth=1, durability=latched))
    said.publish(String(data='source: device'))
    sender.create_publisher(TFMessage, '/tf_static', QoSProfile(depth=1, durability=latched)).publish(TFMessage())
    images = sender.create_publisher(Image, 'image_raw', best_effort)
    end = time.monotonic() + 20
    while len(node._topics) < 3 and time.monotonic() < end:
        images.publish(Image(height=1, width=2, encoding='mono8', step=2, data=[7, 8]))
        executor.spin_once(timeout_sec=0.05)
    executor.shutdown()
    node.destroy_node()
    sender.destroy_node()
    rclpy.shutdown()
    with Reader(tmp_path / 'bag') as bag:
        assert bag.ros_distro == 'jazzy'
        found = {connection.topic: [(qos.reliability, qos.durability) for qos in connection.ext.offered_qos_profiles]
                 for connection in bag.connections}
    assert found == {'/description': [(QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL)],
                     '/tf_static': [(QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL)],
                     '/image_raw': [(QosReliability.BEST_EFFORT, QosDurability.VOLATILE)]}


@pytest.mark.parametrize('name, message', [('there', 'exists already'), ('', 'parameter bag is empty')])
def test_a_bag_that_exists_or_has_no_name_is_refused(tmp_path, name, message):
    (tmp_path / 'there').mkdir()
    with pytest.raises(TactileError, match=message):
        recorder(**({'bag': tmp_path / name} if name else {}))
    rclpy.try_shutdown()
