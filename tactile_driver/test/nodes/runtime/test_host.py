# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Messages between nodes of one process."""
import time

import pytest
import rclpy
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import String
from tactile_driver.nodes.runtime.host import Host, SharedPublisher


@pytest.fixture
def node():
    rclpy.init()
    node = Node('sender', namespace='/pad')
    yield node
    node.destroy_node()
    rclpy.try_shutdown()


@pytest.fixture
def executor(node):
    with SingleThreadedExecutor() as executor:
        yield executor


class Wire:
    """The publisher of the middleware."""

    topic_name = '/pad/words'

    def __init__(self, subscribers=0):
        self.sent, self.subscribers = [], subscribers

    def get_subscription_count(self):
        return self.subscribers

    def publish(self, message):
        self.sent.append(message)


def test_takers_are_called_and_the_middleware_is_left_out_where_nobody_subscribes():
    wire, changes, taken = Wire(), [], []
    shared = SharedPublisher(wire, lambda: changes.append(shared.get_subscription_count()))
    shared.publish('nobody')
    end = shared.attach(lambda message, sent_ns: taken.append((message, time.time_ns() - sent_ns)))
    shared.publish('here')
    wire.subscribers = 2
    assert shared.get_subscription_count() == 3
    shared.publish('both')
    end()
    shared.publish('away')
    assert [word for word, _ in taken] == ['here', 'both'] and all(0 <= passed < 20e9 for _, passed in taken)
    assert wire.sent == ['both', 'away'] and changes == [1, 2]


def test_takers_are_told_how_long_ago_it_was_sent():
    shared, ages = SharedPublisher(Wire(), lambda: None), []
    shared.attach(lambda message, sent_ns: ages.append(time.time_ns() - sent_ns))
    shared.publish('late', 30.0)
    assert 30e9 <= ages[0] < 50e9


def test_a_host_shares_topics_by_their_full_name(node):
    shared, taken = {}, []
    host = Host(shared=shared)
    publisher = host.publisher(node.create_publisher(String, 'words', 10))
    other = Node('taker', namespace='/pad')
    assert not host.has_takers(other, 'words')
    end = Host(shared=shared).listen(other, String, 'words', lambda message, _ns: taken.append(message.data), QoSProfile(depth=10))
    assert host.has_takers(other, 'words') and other.count_subscribers('/pad/words') == 0
    publisher.publish(String(data='a'))
    end()
    assert taken == ['a'] and not host.has_takers(other, 'words')
    other.destroy_node()


def is_free(node, executor):
    """Whether the executor soon ends all subscriptions of the node."""
    deadline = time.monotonic() + 10
    while list(node.subscriptions) and time.monotonic() < deadline:
        executor.spin_once(timeout_sec=0.1)
    return not list(node.subscriptions)


def test_alone_a_node_hears_by_the_middleware_and_when_it_was_received(node, executor):
    host, taken = Host(), []
    publisher = host.publisher(node.create_publisher(String, 'words', 10))
    end = host.listen(node, String, 'words', lambda message, received_ns: taken.append((message.data, time.time_ns() - received_ns)),
                      QoSProfile(depth=10))
    executor.add_node(node)
    deadline = time.monotonic() + 10
    while not taken and time.monotonic() < deadline:
        publisher.publish(String(data='a'))
        executor.spin_once(timeout_sec=0.1)
    assert taken[0][0] == 'a' and 0 < taken[0][1] < 10e9
    end()
    assert is_free(node, executor)


def test_what_has_come_meanwhile_is_taken_in_order_until_the_listener_ends(node, executor):
    taken, ends = [], []

    def take(message, _sent_ns):
        taken.append(message.data)
        if message.data == 'd':
            ends[0]()
    publisher = node.create_publisher(String, 'words', 10)
    ends.append(Host().listen(node, String, 'words', take, QoSProfile(depth=10)))
    executor.add_node(node)
    deadline = time.monotonic() + 10
    while publisher.get_subscription_count() == 0 and time.monotonic() < deadline:
        time.sleep(0.05)
    for word in 'abcdef':
        publisher.publish(String(data=word))
    while 'd' not in taken and time.monotonic() < deadline:
        executor.spin_once(timeout_sec=0.1)
    assert taken == ['a', 'b', 'c', 'd'] and is_free(node, executor)


def test_a_hosts_parameters_go_before_those_of_the_arguments():
    rclpy.init()
    host = Host(['-r', '__ns:=/pad', '-p', 'rate:=1.0', '-p', 'loop:=true'], {'rate': 60.0, 'device': '12'})
    node = Node('camera', **host.options)
    free = ParameterDescriptor(dynamic_typing=True)
    assert [node.declare_parameter(name, None, free).value for name in ('rate', 'loop', 'device')] == [60.0, True, '12']
    assert node.get_fully_qualified_name() == '/pad/camera'
    node.destroy_node()
    rclpy.try_shutdown()


def test_what_is_not_active_tells_nobody():
    rclpy.init()
    driver = LifecycleNode('driver')
    shared, taken = Host(shared={}), []
    publisher = shared.publisher(driver.create_lifecycle_publisher(String, 'words', 10))
    publisher.attach(lambda message, _ns: taken.append(message.data))
    publisher.publish(String(data='early'))
    driver.trigger_configure()
    driver.trigger_activate()
    publisher.publish(String(data='active'))
    driver.trigger_deactivate()
    publisher.publish(String(data='late'))
    driver.destroy_node()
    rclpy.try_shutdown()
    assert taken == ['active']
