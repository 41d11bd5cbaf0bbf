# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings of a running sensor, whatever the disk does."""

import itertools
import os
import signal
import subprocess
import sys
import time

import pytest
import rclpy
import yaml
from geometry_msgs.msg import Point, PointStamped
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from waiting import until

from tactile_bringup.nodes.record_node import LiveBag, RecordNode
from tactile_driver.errors import TactileError
from tactile_driver.nodes.constants import NODES
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_msgs.msg import DotTracks

SIZE = 100_000


def put(bag, number):
    """Whether message number was taken."""
    try:
        bag.write('/raw', 'std_msgs/msg/String', number, number.to_bytes(4, 'little') * (SIZE // 4))
    except OSError:
        return False
    return True


def numbers(path):
    """Of the messages in the bag; each has to be whole."""
    with BagReader(path) as reader:
        found = list(reader.messages())
    assert all(m.data == m.stamp_ns.to_bytes(4, 'little') * (SIZE // 4) for m in found)
    return [m.stamp_ns for m in found]


def test_as_any_other_bag(tmp_path):
    with LiveBag(tmp_path / 'bag') as bag:
        assert all(put(bag, k) for k in range(1, 31))
    assert numbers(tmp_path / 'bag') == list(range(1, 31))
    assert sorted(os.listdir(tmp_path / 'bag')) == ['bag_0.mcap', 'metadata.yaml']


def recorder(**values):
    arguments = [word for name, value in values.items() for word in ('-p', f'{name}:={value}')]
    rclpy.init(args=['--ros-args', *arguments])
    return RecordNode()


def test_messages_are_written_as_they_were_sent(tmp_path):
    node = recorder(bag=tmp_path / 'bag')
    sender, executor = rclpy.create_node('sender'), SingleThreadedExecutor()
    executor.add_node(node)
    outputs = [sender.create_publisher(kind, topic, 10) for kind, topic in ((DotTracks, 'dots'), (Image, 'image_raw'),
                                                                            (PointStamped, 'ground_truth/tip'))]
    listener = sender.create_subscription(Image, 'image_raw', lambda _message: None, 10)
    sent = DotTracks(rows=2, columns=3, id=[1, 5], u=[1.5, 2.5])
    heard = itertools.count()

    def recorded():
        outputs[0].publish(sent)
        outputs[1].publish(Image(height=1, width=2, encoding='mono8', step=2, data=[7, 8]))
        outputs[2].publish(PointStamped(point=Point(x=0.5)))
        # The recorder too: it takes raw data after those who work on it.
        return outputs[1].get_subscription_count() == 2 and next(heard) >= 6 and node.written >= 9
    assert until(recorded, executor)
    written = node.written
    executor.shutdown()
    node.destroy_node()
    sender.destroy_subscription(listener)
    sender.destroy_node()
    rclpy.shutdown()
    with BagReader(tmp_path / 'bag') as bag:
        messages = list(bag.messages())
        assert bag.topics['/image_raw'] == 'sensor_msgs/msg/Image'
    assert len(messages) == written >= 6
    assert all(decode(m.data, m.type_name) == sent for m in messages if m.topic == '/dots')
    assert {decode(m.data, m.type_name).point.x for m in messages if m.topic == '/ground_truth/tip'} == {0.5}
    assert {bytes(decode(m.data, m.type_name).data) for m in messages if m.topic == '/image_raw'} == {bytes([7, 8])}


def test_the_bag_carries_what_was_offered_and_what_was_latched_before(tmp_path):
    best_effort, latched = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT), DurabilityPolicy.TRANSIENT_LOCAL
    node = recorder(bag=tmp_path / 'bag', patience=0.0)
    sender, executor = rclpy.create_node('sender'), SingleThreadedExecutor()
    executor.add_node(node)
    said = sender.create_publisher(String, 'description', QoSProfile(depth=1, durability=latched))
    said.publish(String(data='source: device'))
    positions = sender.create_publisher(TFMessage, '/tf_static', QoSProfile(depth=1, durability=latched))
    positions.publish(TFMessage())
    images = sender.create_publisher(Image, 'image_raw', best_effort)
    others = [(sender.create_publisher(kind, topic, 5), kind()) for topic, kind in (('/tf', TFMessage), ('/joint_states', JointState))]
    end, enough = time.monotonic() + 60, 40
    while node.written < enough and time.monotonic() < end:
        for publisher, message in others:
            publisher.publish(message)
        images.publish(Image(height=1, width=2, encoding='mono8', step=2, data=[7, 8]))
        executor.spin_once(timeout_sec=0.05)
        joined = all(one.get_subscription_count() for one in (said, positions, images, *(publisher for publisher, _ in others)))
        if not joined or not all(one.wait_for_all_acked(Duration()) for one in (said, positions)):
            enough = node.written + 200
    executor.shutdown()
    node.destroy_node()
    sender.destroy_node()
    rclpy.shutdown()
    about = yaml.safe_load((tmp_path / 'bag' / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    topics = [topic['topic_metadata'] for topic in about['topics_with_message_count']]
    found = {topic['name']: [(qos['reliability'], qos['durability']) for qos in topic['offered_qos_profiles']] for topic in topics}
    assert about['ros_distro'] == 'jazzy'
    assert found == {'/description': [('reliable', 'transient_local')], '/tf_static': [('reliable', 'transient_local')],
                     '/image_raw': [('best_effort', 'volatile')], '/tf': [('reliable', 'volatile')],
                     '/joint_states': [('reliable', 'volatile')]}


@pytest.mark.parametrize('name, message', [('there', 'exists already'), ('', 'parameter bag is empty')])
def test_a_bag_that_exists_or_has_no_name_is_refused(tmp_path, name, message):
    (tmp_path / 'there').mkdir()
    with pytest.raises(TactileError, match=message):
        recorder(**({'bag': tmp_path / name} if name else {}))
    rclpy.try_shutdown()


@pytest.mark.full
@pytest.mark.parametrize('hangs', ['rclpy.node.Node.destroy_node', 'rclpy.try_shutdown'])
def test_middleware_that_hangs_after_the_bag_is_closed_holds_the_process_for_seconds_only(tmp_path, hangs):
    program = f"""
import threading, rclpy, rclpy.node
from tactile_bringup.nodes.record_node import main
{hangs} = lambda *_: threading.Event().wait()
main()
"""
    process = subprocess.Popen([sys.executable, '-c', program, '--ros-args', '-p', f'bag:={tmp_path / "bag"}'], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    assert until((tmp_path / 'bag').exists, patience_s=60)
    process.send_signal(signal.SIGINT)
    assert 'messages recorded' in process.stdout.readline()
    closed_s = time.monotonic()
    error = process.communicate(timeout=60)[1]
    assert process.returncode == 1 and 'threading.py' in error
    assert time.monotonic() - closed_s < 2 * NODES.max_close_s
    assert (tmp_path / 'bag' / 'metadata.yaml').exists()
