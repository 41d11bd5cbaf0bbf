# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The node over ROS: results under the images' stamps, no work without subscribers, reference and object on request."""
import os
import time

import numpy as np
import pytest

rclpy = pytest.importorskip('rclpy')
os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
from geometry_msgs.msg import TransformStamped, WrenchStamped  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from sensor_msgs.msg import Image  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from tactile_driver.frame import Frame  # noqa: E402
from tactile_driver.nodes.messages.conversions import header_of, image_to_message  # noqa: E402
from tactile_driver.nodes.runtime.host import Host  # noqa: E402
from tactile_msgs.msg import Contacts  # noqa: E402
from tactile_perception.node import make_node  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402

pytestmark = pytest.mark.ros


@pytest.fixture
def make_bench():
    rclpy.init()
    executor, nodes = SingleThreadedExecutor(), []

    def make(parameters=()):
        nodes.extend([make_node('taxel_contact_node', Host(parameters={p.name: p.value for p in parameters})), rclpy.create_node('helper')])
        for node in nodes:
            executor.add_node(node)
        return *nodes, until

    def until(condition, seconds=10.0):
        end = time.monotonic() + seconds
        while not condition() and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.02)
        assert condition()
    yield make
    executor.shutdown()  # or it may hold the nodes' subscriptions
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown()


def image(level, number):
    values = np.full((44, 44), 3, np.uint8)
    values[15:30, 10:35] += np.uint8(level)
    return image_to_message(Frame(values, 0, 'mono8'), '', header_of(10**9 + number * 10**7, 'pad'))


def test_contacts_reference_and_object(make_bench):
    node, helper, until = make_bench()
    publisher = helper.create_publisher(Image, 'image_raw', 100)
    assert publisher.get_subscription_count() == 0
    heard = []
    helper.create_subscription(Contacts, 'contacts', heard.append, 100)
    until(lambda: publisher.get_subscription_count() == 1)
    for number, level in enumerate([0] * 5 + [100] * 5):
        publisher.publish(image(level, number))
    until(lambda: len(heard) == 10)
    assert [len(message.contacts) for message in heard] == [0] * 5 + [1] * 5
    assert [message.header.stamp.nanosec for message in heard] == [k * 10**7 for k in range(10)]

    assert not node.set_parameters([Parameter('object.gravity', value=[0.0, 0.0, 0.0])])[0].successful
    assert node.set_parameters([Parameter('object.depth', value=3e-4)])[0].successful
    assert node.stage.estimator.grasped.depth == 3e-4

    client = helper.create_client(Trigger, 'set_reference')
    until(client.service_is_ready)
    answer = client.call_async(Trigger.Request())
    until(answer.done)
    assert answer.result().success
    publisher.publish(image(100, 20))
    until(lambda: len(heard) == 11)
    assert not heard[-1].contacts


def test_transforms_of_the_robot_turn_the_weight_into_the_sensor_frame(make_bench):
    node, helper, until = make_bench([Parameter('object.weight', value=4.0), Parameter('object.gravity_frame', value='world'),
                                      Parameter('object.gravity', value=[0.0, 0.0, -1.0])])
    publisher, heard = helper.create_publisher(Image, 'image_raw', 100), []
    helper.create_subscription(WrenchStamped, 'wrench', heard.append, 100)
    moving = helper.create_publisher(TFMessage, '/tf', 10)
    until(lambda: publisher.get_subscription_count() == 1 and moving.get_subscription_count() == 1)
    publisher.publish(image(0, 0))
    until(lambda: len(heard) == 1)
    assert 'no transform leads from world' in node.stage.health()[0]
    link = TransformStamped(child_frame_id='pad')
    link.header.frame_id = 'world'
    link.transform.rotation.x, link.transform.rotation.w = np.sqrt(0.5), np.sqrt(0.5)  # the pad's y is up
    moving.publish(TFMessage(transforms=[link]))
    until(lambda: node.stage.health()[0] == '')
    publisher.publish(image(100, 1))
    until(lambda: len(heard) == 2)
    assert [heard[1].wrench.force.x, heard[1].wrench.force.y] == pytest.approx([0.0, -2.0], abs=1e-9)
