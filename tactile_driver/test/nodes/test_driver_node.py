# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What all drivers share: transitions, streams, waiting frames."""

import subprocess
import sys
import time

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from fake_source import FakeSource
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter as RosParameter
from sensor_msgs.msg import Image
from waiting import until

from tactile_driver.errors import BadArgument, DeviceLost
from tactile_driver.nodes.driver_node import DriverNode
from tactile_driver.nodes.messages.conversions import instants, stamp_ns_of
from tactile_driver.nodes.runtime.diagnostics import ERROR
from tactile_driver.nodes.runtime.host import Host, SharedPublisher
from tactile_driver.nodes.taxel_array_node import TaxelArrayNode
from tactile_driver.parameters.table import Parameter

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
    assert np.median(np.abs(reported - by_stamp)) < BLOCKED_S / 2


def test_of_a_recording_each_counts(ages, tmp_path):
    np.save(tmp_path / 'press.npy', np.zeros((100, 8, 8), np.uint16))
    reported, _ = ages(source='file', path=str(tmp_path / 'press.npy'), rows=8, columns=8, rate=0.0)
    assert np.median(reported) < BLOCKED_S / 2


SUBSCRIBER = """
import rclpy
from sensor_msgs.msg import Image
rclpy.init()
node = rclpy.create_node('subscriber')
node.create_subscription(Image, 'image_raw', lambda message: None, 10)
rclpy.spin(node)
"""


def test_a_recording_as_fast_as_received_is_acknowledged_at_once(tmp_path, monkeypatch):
    """Fast DDS may ask for an acknowledgement only every 3 s: most waits would reach their limit of 1 s."""
    acknowledged, wait = [], SharedPublisher.wait_for_all_acked
    monkeypatch.setattr(SharedPublisher, 'wait_for_all_acked', lambda *args: acknowledged.append(wait(*args)))
    np.save(tmp_path / 'press.npy', np.zeros((20, 8, 8), np.uint16))
    rclpy.init()
    node = TaxelArrayNode(Host(parameters={'source': 'file', 'path': str(tmp_path / 'press.npy'), 'rows': 8, 'columns': 8, 'rate': 0.0,
                                           'autostart': False}))
    subscriber = subprocess.Popen([sys.executable, '-c', SUBSCRIBER])
    assert until(lambda: node.raw[0].get_subscription_count() == 1)
    node.trigger_configure()
    node.trigger_activate()
    assert until(lambda: len(acknowledged) == 20, patience_s=60)
    subscriber.kill()
    subscriber.wait(10)
    node.destroy_node()
    rclpy.try_shutdown()
    assert np.mean(acknowledged) > 0.8


TABLE = (Parameter('autostart', bool, False, '', 'start by itself', read_only=True),
         Parameter('stay', bool, True, '', 'after a recording', read_only=True),
         Parameter('exposure', float, 0.0, 's', 'live', 0.0, 1.0),
         *(Parameter(name, str, '', '', 'fixed') for name in ('source', 'frame_id', 'sensor_type', 'path')))


class Driver(DriverNode):
    """Publishes into a list."""

    subscribers = 1

    def __init__(self, film, **values):
        self.film, self.published = film, []
        super().__init__('driver', TABLE, 'camera', Host(parameters=values))

    def open_source(self, values):
        self.film.open()
        return self.film

    def publish(self, stream, frame):
        self.published.append(frame)


@pytest.fixture
def node():
    """Makes the node; error: what opening its source raises."""
    rclpy.init()
    made = []

    def make(error=None, live=True, **values):
        film = FakeSource(live=live, script=() if live else range(10**4), about={'serial': 'A1'})
        film.open_errors = [error] if error else []
        made.append(Driver(film, **values))
        return made[-1], film
    yield make
    for each in made:
        each.destroy_node()
    rclpy.try_shutdown()


def test_transitions_open_run_hold_and_close_the_source(node):
    driver, film = node()
    assert driver.trigger_configure() == TransitionCallbackReturn.SUCCESS
    assert driver.trigger_activate() == TransitionCallbackReturn.SUCCESS
    assert until(lambda: len(driver.published) > 3)
    assert driver.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
    time.sleep(0.1)
    count = len(driver.published)
    time.sleep(0.1)
    assert len(driver.published) == count
    assert driver.trigger_cleanup() == TransitionCallbackReturn.SUCCESS
    assert film.calls == ['open', 'close']
    assert driver.trigger_configure() == driver.trigger_activate() == TransitionCallbackReturn.SUCCESS
    assert driver.trigger_shutdown() == TransitionCallbackReturn.SUCCESS
    assert film.calls == ['open', 'close'] * 2


@pytest.mark.parametrize('stay', [True, False])
def test_a_node_says_that_its_recording_is_over_and_ends_unless_it_is_to_stay(node, stay):
    driver, film = node(live=False, stay=stay)
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
        return any(text in message for message in heard)
    driver.trigger_configure()
    driver.trigger_activate()
    assert until(lambda: says(' Hz'), executor)
    film.script = [1, 2, 3]
    assert until(ends, patience_s=3.0 if stay else 60.0) != stay
    assert until(lambda: says('ended'))
    executor.shutdown(), ears.shutdown()
    listener.destroy_node()


def test_only_live_parameters_change_while_it_runs(node):
    driver, film = node()
    driver.trigger_configure()
    refused, = driver.set_parameters([RosParameter('path', value='x')])
    assert not refused.successful and 'deactivate and clean up' in refused.reason
    assert driver.set_parameters([RosParameter('exposure', value=0.5)])[0].successful
    assert {'exposure': 0.5} in film.calls


@pytest.mark.parametrize(('error', 'result'), [(DeviceLost('no camera'), 'FAILURE'), (BadArgument('bad path'), 'FAILURE'),
                                               (RuntimeError('odd'), 'ERROR')])
def test_what_cannot_be_opened_is_reported(node, error, result):
    driver, _ = node(error)
    listener, heard = rclpy.create_node('listener'), []
    listener.create_subscription(DiagnosticArray, '/diagnostics', lambda message: heard.extend(message.status), 10)
    assert driver.trigger_configure() == getattr(TransitionCallbackReturn, result)
    executor = SingleThreadedExecutor()
    for each in (driver, listener):
        executor.add_node(each)
    assert until(lambda: any(s.level == ERROR and str(error) in s.message for s in heard), executor)
    executor.shutdown()
    listener.destroy_node()


def test_a_file_in_another_order(driven, tmp_path):
    np.save(tmp_path / 'a.npy', np.arange(6, dtype=np.uint16).reshape(1, 2, 3) * 1000)
    one = driven(TaxelArrayNode, source='file', path=str(tmp_path / 'a.npy'), rows=3, columns=2, transposed=True, flip_rows=True, loop=True,
                 rate=20.0)
    image, = one.received(('image_raw', Image))
    assert image.encoding == 'mono16' and np.frombuffer(image.data, np.uint16).tolist() == [2000, 5000, 1000, 4000, 0, 3000]


def test_truth_is_reported_at_the_first_sample_and_where_it_changes():
    assert instants(np.array([0, 0, 1, 1, 2, 0])) == [0, 2, 4, 5]
    assert instants(np.array([1])) == [0]
