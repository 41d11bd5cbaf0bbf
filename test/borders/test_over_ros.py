# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A thousand random messages over the middleware to a running node: it survives, reports rejected ones, and processes the next good one."""
import random
import time

import pytest

rclpy = pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from fed_nodes import arguments, at, own_parameters, sent, stamp_of  # noqa: E402
from random_messages import hostile  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.qos import QoSProfile  # noqa: E402
from tactile_bringup.nodes.compose import kind_of  # noqa: E402
from tactile_driver.nodes.runtime.host import Host  # noqa: E402
from tactile_msgs.msg import Contacts, DotTracks  # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.filterwarnings('ignore::RuntimeWarning')]
_COUNT, _QUEUE = 1000, QoSProfile(depth=100)


@pytest.mark.parametrize('name, sensor, topics', [
    ('psd_contact_node', 'psd_finger', ('voltages',)), ('taxel_contact_node', 'taxel_array', ('image_raw',)),
    ('contact_region_node', 'touchpad', ('camera_info', 'dots')), ('contact_point_node', 'areal_single', ('camera_info', 'dots')),
    ('dot_tracker_node', 'touchpad', ('camera_info', 'image_raw'))])
def test_a_thousand_random_messages_over_ros(name, sensor, topics):
    space, rng, heard = f'/over_{name}', random.Random(5), []
    node = kind_of(name)(Host(arguments(space, sensor), own_parameters(name, sensor)))
    sender, executor = rclpy.create_node('sender'), SingleThreadedExecutor()
    found = [(topic, message) for topic, message in sent(sensor) if topic in topics]
    outputs = {topic: sender.create_publisher(type(message), f'{space}/{topic}', _QUEUE) for topic, message in found}
    kind, topic = (DotTracks, 'dots') if name == 'dot_tracker_node' else (Contacts, 'contacts')
    sender.create_subscription(kind, f'{space}/{topic}', heard.append, _QUEUE)
    executor.add_node(node), executor.add_node(sender)

    def until(condition, seconds=20.0):
        end = time.monotonic() + seconds
        while not condition() and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.02)
        return condition()

    try:
        assert until(lambda: all(output.get_subscription_count() for output in outputs.values()))
        stamp = time.time_ns()
        for number in range(_COUNT):
            stamp += 1_000_000
            topic, message = found[number % len(found)]
            outputs[topic].publish(hostile(rng, at(message, stamp)))
            for _ in range(3):  # the executor takes a message at a time, of the node or of the sender
                executor.spin_once(timeout_sec=0.002)
        until(lambda: False, 1.0)
        assert node.log.refused > _COUNT / 10 and node.net.caught == 0, (node.log.refused, node.log.done)
        refused, done = node.log.refused, node.log.done
        assert node._examine().values['refused frames'] == refused

        def send_good():
            nonlocal stamp
            for topic, message in found[:12]:
                stamp += 1_000_000
                outputs[topic].publish(at(message, stamp))
                executor.spin_once(timeout_sec=0.02)
            return node.log.done > done and heard and stamp_of(heard[-1]) > stamp - 10**9
        assert until(send_good)
    finally:
        executor.shutdown(), node.destroy_node(), sender.destroy_node()
