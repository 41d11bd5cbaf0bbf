# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import math
import time

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from tactile_driver.errors import BadArgument
from tactile_driver.nodes.runtime.diagnostics import OK, WARN, Health, LogOnce, NodeDiagnostics


@pytest.fixture
def node():
    context = Context()
    rclpy.init(context=context)
    node = Node('diagnosed', context=context)
    yield node
    node.destroy_node()
    rclpy.shutdown(context=context)


def test_health_is_published(node):
    received = []
    node.create_subscription(DiagnosticArray, '/diagnostics', received.append, 10)
    diagnostics = NodeDiagnostics(node, 'camera', 'A111', lambda: Health(WARN, 'slow; more light', {'rate (Hz)': 14.23456, 'frames': 7}))
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    end = time.monotonic() + 10
    while not any(s.message.startswith('slow') for m in received for s in m.status) and time.monotonic() < end:
        diagnostics.update()
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    status = next(s for m in received for s in m.status if s.message.startswith('slow'))
    assert (status.name, status.level, status.hardware_id) == ('/diagnosed: camera', WARN, 'A111')
    assert {v.key: v.value for v in status.values} == {'rate (Hz)': '14.23', 'frames': '7', 'what to do': 'more light'}


@pytest.mark.parametrize('name, value', [('period', math.nan), ('period', math.inf), ('period', -1.0), ('period', 0.0),
                                         ('period', 'a second'), ('use_fqn', 'no')])
def test_a_wrong_parameter_is_refused_at_the_start(node, name, value):
    name = f'diagnostic_updater.{name}'
    node._parameter_overrides[name] = Parameter(name, value=value)
    with pytest.raises(BadArgument, match=name):
        NodeDiagnostics(node, 'camera', 'A111', lambda: Health(OK, ''))


def test_the_period_is_fixed_at_the_start(node):
    name = 'diagnostic_updater.period'
    node._parameter_overrides[name] = Parameter(name, value=0.5)
    NodeDiagnostics(node, 'camera', 'A111', lambda: Health(OK, ''))
    for value in (math.inf, math.nan, 2.0):
        assert not node.set_parameters([Parameter(name, value=value)])[0].successful
    assert node.get_parameter(name).value == 0.5


def test_a_message_is_said_once_until_it_is_forgotten():
    said = []
    logger = type('Logger', (), {'error': lambda _self, text: said.append(text), 'warning': lambda _self, text: said.append('W ' + text)})()
    say = LogOnce(type('FakeNode', (), {'get_logger': lambda _self: logger})())
    for _ in range(3):
        say.error('black', 'the frame is black')
        say.warning('slow', 'slow')
    say.forget('black')
    say.error('black', 'black again')
    assert said == ['the frame is black', 'W slow', 'black again']


class Lines:
    """In place of a node and its logger."""

    def __init__(self):
        self.lines = []

    def get_logger(self):
        return self

    def error(self, text):
        self.lines.append(text)


def test_what_comes_and_goes_within_a_second_is_said_once(monkeypatch):
    log = Lines()
    say, now = LogOnce(log), [0.0]
    monkeypatch.setattr('tactile_driver.nodes.runtime.diagnostics.time.monotonic', lambda: now[0])
    for _ in range(100):
        say.error('frame', 'the frame is cut')
        now[0] += 0.03
        say.settle('frame')
    assert len(log.lines) == 1
    now[0] += 1.1
    say.settle('frame')
    say.error('frame', 'the frame is cut')
    assert len(log.lines) == 2, 'it was well for a while: the next time is news'
