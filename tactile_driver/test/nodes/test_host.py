# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes in one process, and subscriptions that adopt what publishers offer."""

import time

import pytest
import rclpy
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String
from waiting import until

from tactile_driver.nodes.runtime.host import AdaptiveSubscription, Host, SerializedSubscription, SharedPublisher


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
    assert [word for word, _ in taken] == ['here', 'both'] and all(0 <= passed < 60e9 for _, passed in taken)
    assert wire.sent == ['both', 'away'] and changes == [1, 2]


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
    """Whether the executor ends all subscriptions of the node."""
    return until(lambda: not list(node.subscriptions), executor)


def test_alone_a_node_hears_by_the_middleware_and_when_it_was_received(node, executor):
    host, taken = Host(), []
    publisher = host.publisher(node.create_publisher(String, 'words', 10))
    end = host.listen(node, String, 'words', lambda message, received_ns: taken.append((message.data, time.time_ns() - received_ns)),
                      QoSProfile(depth=10))
    executor.add_node(node)
    assert until(lambda: publisher.publish(String(data='a')) or taken, executor)
    assert taken[0][0] == 'a' and 0 < taken[0][1] < 60e9
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
    assert until(publisher.get_subscription_count)
    for word in 'abcdef':
        publisher.publish(String(data=word))
    assert until(lambda: 'd' in taken, executor)
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


pytestmark = pytest.mark.full
RELIABLE, BEST_EFFORT = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
LATCHED, VOLATILE = DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE


class Bench:
    """A node that listens, one that publishes, both in an executor."""

    def __init__(self):
        self.listener, self.sender = rclpy.create_node('listener'), rclpy.create_node('sender')
        self.executor, self.heard = SingleThreadedExecutor(), []
        for node in (self.listener, self.sender):
            self.executor.add_node(node)

    def listen(self, kind=String, raw=False, durability=VOLATILE):
        qos = QoSProfile(depth=10, durability=durability)
        make = SerializedSubscription if raw else AdaptiveSubscription
        return make(self.listener, kind, 'words', lambda message, ns: self.heard.append((message, ns)), qos)

    def publisher(self, reliability=RELIABLE, durability=VOLATILE):
        return self.sender.create_publisher(String, 'words', QoSProfile(depth=10, reliability=reliability, durability=durability))

    def until(self, condition):
        return until(condition, self.executor)

    def hears(self, publisher, word):
        """Whether what is said from now on arrives."""
        def said():
            publisher.publish(String(data=word))
            return any(message.data == word for message, _ in self.heard)
        return self.until(said)


@pytest.fixture
def bench():
    rclpy.init()
    bench = Bench()
    yield bench
    bench.executor.shutdown()
    for node in (bench.listener, bench.sender):
        node.destroy_node()
    rclpy.try_shutdown()


def test_it_follows_what_publishers_offer_as_they_come_and_go(bench):
    subscription = bench.listen()
    assert subscription.policies == (RELIABLE, VOLATILE), 'nothing is published yet'
    careless = bench.publisher(BEST_EFFORT)
    assert bench.until(lambda: subscription.policies == (BEST_EFFORT, VOLATILE)) and bench.hears(careless, 'careless')
    careful = bench.publisher(RELIABLE)
    assert bench.hears(careful, 'careful') and bench.hears(careless, 'still') and subscription.policies[0] == BEST_EFFORT
    bench.sender.destroy_publisher(careless)
    assert bench.until(lambda: subscription.policies[0] == RELIABLE) and bench.hears(careful, 'alone')
    assert bench.until(lambda: len(list(bench.listener.subscriptions)) == 1)
    subscription.close()
    assert bench.until(lambda: not list(bench.listener.subscriptions))


@pytest.mark.parametrize('before', [True, False])
def test_what_is_latched_arrives_though_it_was_published_before(bench, before):
    publisher = bench.publisher(durability=LATCHED) if before else None
    subscription = bench.listen(durability=LATCHED)
    publisher = publisher or bench.publisher(durability=LATCHED)
    publisher.publish(String(data='once'))
    assert bench.until(lambda: subscription.policies == (RELIABLE, LATCHED))
    assert bench.until(lambda: bench.heard) and {message.data for message, _ in bench.heard} == {'once'}
    passing = bench.publisher()
    assert bench.until(lambda: subscription.policies == (RELIABLE, VOLATILE)) and bench.hears(passing, 'passing')


def test_the_first_message_tells_how_many_were_published_before_it(bench):
    missed, publisher = [], bench.publisher()
    for _ in range(7):
        publisher.publish(String(data='early'))
    subscription = AdaptiveSubscription(bench.listener, String, 'words', lambda message, ns: bench.heard.append((message, ns)),
                                        QoSProfile(depth=10), begin=missed.append)
    assert bench.until(lambda: publisher.get_subscription_count())
    assert bench.hears(publisher, 'late') and bench.hears(publisher, 'later')
    assert missed == [7] and subscription.policies == (RELIABLE, VOLATILE)


def test_of_a_stream_nothing_old_comes_though_it_is_kept(bench):
    publisher = bench.publisher(durability=LATCHED)
    publisher.publish(String(data='old'))
    subscription = bench.listen()
    assert bench.hears(publisher, 'new') and {message.data for message, _ in bench.heard} == {'new'}
    assert subscription.policies == (RELIABLE, VOLATILE)
