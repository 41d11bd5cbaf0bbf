# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What all drivers share: transitions, streams, waiting frames."""

import time

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter as RosParameter
from tactile_driver.errors import BadArgument, DeviceLost
from tactile_driver.nodes.driver_node import DriverNode
from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.nodes.runtime.diagnostics import ERROR, OK, Health
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.taxel_array_node import TaxelArrayNode
from tactile_driver.parameters.table import Parameter
from tactile_driver.sources.capture import CaptureStatus
from waiting import until

BLOCKED_S = 1.0


@pytest.fixture
def ages():
    """ages(**parameters): how long ago, s, each of some images of an array was sent as reported, and by its stamp; the taker is blocked for
    a while."""
    rclpy.init()

    def of(**parameters):
        found, shared = [], {}

        def take(message, sent_ns):
            found.append([1e-9 * (time.time_ns() - ns) for ns in (sent_ns, stamp_ns_of(message.header))])
            if len(found) == 10:
                time.sleep(BLOCKED_S)
        node = TaxelArrayNode(Host(parameters={'source': 'sim', 'autostart': False, 'rate': 100.0, **parameters}, shared=shared))
        shared[node.resolve_topic_name('image_raw')].attach(take)
        node.trigger_configure()
        node.trigger_activate()
        assert until(lambda: len(found) >= 60)
        node.destroy_node()
        return np.array(found[10:60]).T
    yield of
    rclpy.try_shutdown()


def test_of_a_live_source_takers_are_reported_how_long_each_has_waited(ages):
    reported, by_stamp = ages()
    assert np.median(np.abs(reported - by_stamp)) < 0.2


def test_of_a_recording_each_counts(ages, tmp_path):
    np.save(tmp_path / 'press.npy', np.zeros((100, 8, 8), np.uint16))
    reported, _ = ages(source='file', path=str(tmp_path / 'press.npy'), rows=8, columns=8, rate=0.0)
    assert np.median(reported) < BLOCKED_S / 2


TABLE = (Parameter('autostart', bool, False, '', 'start by itself', read_only=True),
         Parameter('stay', bool, True, '', 'after a recording', read_only=True),
         Parameter('exposure', float, 0.0, 's', 'live', 0.0, 1.0), Parameter('path', str, '', '', 'fixed'))


class Stream:
    """Notes what is asked of it."""

    warning, over = '', False
    status = CaptureStatus('running', 1, 0, 0, 10.0, 0.01, '')

    def __init__(self):
        self.calls = []
        self.health = lambda: Health(OK, '10.0 Hz')
        self.source = type('Source', (), {'live': True, 'describe': staticmethod(lambda: {'serial': 'A1', 'rate': 10.0})})()

    def __getattr__(self, name):
        return lambda *arguments: self.calls.append((name, *arguments))


@pytest.fixture
def node():
    """Makes the node; error: what opening its stream raises."""
    rclpy.init()
    made = []

    def make(error=None, **values):
        stream = Stream()

        def open_stream(values):
            if error is not None:
                raise error
            return stream
        made.append(DriverNode('driver', TABLE, 'camera', Host(parameters=values)))
        made[-1].open_stream = open_stream
        return made[-1], stream
    yield make
    for each in made:
        each.destroy_node()
    rclpy.try_shutdown()


def test_transitions_open_run_hold_and_close_the_stream(node):
    driver, stream = node()
    for change in (driver.trigger_configure, driver.trigger_activate, driver.trigger_deactivate, driver.trigger_cleanup):
        assert change() == TransitionCallbackReturn.SUCCESS
    assert [name for name, *_ in stream.calls] == ['resume', 'pause', 'stop']


@pytest.mark.parametrize('stay', [True, False])
def test_a_node_says_that_its_recording_is_over_and_ends_unless_it_is_to_stay(node, stay):
    driver, stream = node(stay=stay)
    listener, heard = rclpy.create_node('listener'), []
    listener.create_subscription(DiagnosticArray, '/diagnostics', lambda message: heard.extend(s.message for s in message.status), 10)
    executor, ears = SingleThreadedExecutor(), SingleThreadedExecutor()
    executor.add_node(driver)
    ears.add_node(listener)

    def ends():
        try:
            executor.spin_once(timeout_sec=0.02)
        except KeyboardInterrupt:
            return True
        return False

    def says(text):
        ears.spin_once(timeout_sec=0.02)
        return text in heard
    driver.trigger_configure()
    driver.trigger_activate()
    assert until(lambda: says('10.0 Hz'), executor)
    stream.health, stream.over = lambda: Health(OK, 'ended'), True
    assert until(ends, patience_s=2.5 if stay else 60.0) != stay
    assert until(lambda: says('ended'))
    executor.shutdown(), ears.shutdown()
    listener.destroy_node()


def test_only_live_parameters_change_while_it_runs(node):
    driver, stream = node()
    driver.trigger_configure()
    refused, = driver.set_parameters([RosParameter('path', value='x')])
    assert not refused.successful and 'deactivate and clean up' in refused.reason
    assert driver.set_parameters([RosParameter('exposure', value=0.5)])[0].successful
    assert ('change', {'exposure': 0.5}) in stream.calls
    assert driver._examine().level == OK


@pytest.mark.parametrize(('error', 'result'), [(DeviceLost('no camera'), 'FAILURE'), (BadArgument('bad path'), 'FAILURE'),
                                               (RuntimeError('odd'), 'ERROR')])
def test_what_cannot_be_opened_is_reported(node, error, result):
    driver, _ = node(error)
    assert driver.trigger_configure() == getattr(TransitionCallbackReturn, result)
    health = driver._examine()
    assert health.level == ERROR and str(error) in health.message
