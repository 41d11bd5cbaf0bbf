# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a node reports of itself: its health, repeated messages, defects and parameters."""
import math
from dataclasses import replace

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Parameter as Parameter_defect, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from waiting import until

from tactile_driver.nodes import health as module
from tactile_driver.nodes.health import SampleMeter, capture_health, unconfigured_health
from tactile_driver.nodes.runtime.defect_guard import DefectGuard, guard_services
from tactile_driver.nodes.runtime.diagnostics import ERROR, OK, WARN, Health, LogOnce, NodeDiagnostics
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.parameters.table import Parameter as Declared
from tactile_driver.sources.capture import CaptureStatus


def test_health_is_published(node):
    received = []
    node.create_subscription(DiagnosticArray, '/diagnostics', received.append, 10)
    diagnostics = NodeDiagnostics(node, 'camera', 'A111', lambda: Health(WARN, 'slow; more light', {'rate (Hz)': 14.23456, 'frames': 7}))
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    assert until(lambda: diagnostics.update() or any(s.message.startswith('slow') for m in received for s in m.status), executor)
    executor.shutdown()
    status = next(s for m in received for s in m.status if s.message.startswith('slow'))
    assert (status.name, status.level, status.hardware_id) == ('/tested: camera', WARN, 'A111')
    assert {v.key: v.value for v in status.values} == {'rate (Hz)': '14.23', 'frames': '7', 'what to do': 'more light'}


class Log:
    """Stands in for a node and its logger."""

    def __init__(self):
        self.lines = []

    def get_logger(self):
        return self

    def error(self, text):
        self.lines.append(text)

    warning = error


def test_a_message_is_said_once_until_it_is_forgotten():
    log = Log()
    say = LogOnce(log)
    for _ in range(3):
        say.error('black', 'the frame is black')
        say.warning('slow', 'slow')
    say.reset('black')
    say.error('black', 'black again')
    assert log.lines == ['the frame is black', 'slow', 'black again']


def test_what_comes_and_goes_within_a_second_is_said_once(monkeypatch):
    log = Log()
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


def failed(log, net, error):
    try:
        raise error
    except Exception as caught:
        return net.catch(caught, 'dots')


def test_a_defect_is_counted_each_time_and_logged_once_with_its_traceback(monkeypatch):
    monkeypatch.setattr(DefectGuard, 'strict', False)
    log = Log()
    net = DefectGuard(log)
    reported = [failed(log, net, IndexError('index 7')) for _ in range(3)]
    assert net.caught == 3 and 'dots' in reported[0] and "IndexError('index 7')" in reported[0]
    assert len(log.lines) == 1 and 'Traceback' in log.lines[0] and 'please report it' in log.lines[0]
    with pytest.raises(ZeroDivisionError) as other:
        1 / 0
    net.catch(other.value, 'dots')
    assert net.caught == 4 and len(log.lines) == 2, 'another line of code'


@pytest.fixture
def services(node):
    node.declare_parameter('rate', 1.0)
    guard_services(node)
    return {service.srv_type: service.callback for service in node.services}


def request(kind, type_):
    return kind.Request(parameters=[Parameter_defect(name='rate', value=ParameterValue(type=type_, double_value=2.0))] * 2)


def test_parameters_of_a_type_that_does_not_exist_are_refused_with_a_reason(services):
    answer = services[SetParameters](request(SetParameters, 200), SetParameters.Response())
    assert [result.successful for result in answer.results] == [False, False] and '200' in answer.results[0].reason
    answer = services[SetParametersAtomically](request(SetParametersAtomically, 10), SetParametersAtomically.Response())
    assert not answer.result.successful and '10' in answer.result.reason


def test_a_transition_that_the_state_does_not_allow_fails(services):
    asked = ChangeState.Request()
    asked.transition.id = 255
    assert not services[ChangeState](asked, ChangeState.Response()).success
    asked.transition.id = 1
    assert services[ChangeState](asked, ChangeState.Response()).success, 'configured'


TABLE = (Declared('rate', float, 30.0, 'Hz', 'frames a second', 0.0, 100.0), Declared('device', str, '0', '', 'which'),
         Declared('width', int, 640, 'px', 'of the image', 1, 4096), Declared('offsets', list[float], [], 'm', 'where'),
         Declared('autostart', bool, True, '', 'by itself', read_only=True))


@pytest.fixture
def make(node):
    """Makes (node, parameters) with values given at the start; destroys the nodes at the end."""
    nodes = []

    def with_values(check=None, apply=None, **values):
        overrides = [RosParameter(n, value=v) for n, v in values.items()]
        nodes.append(Node('parameters_test', context=node.context, parameter_overrides=overrides))
        return nodes[-1], NodeParameters(nodes[-1], TABLE, check, apply)
    yield with_values
    for made in nodes:
        made.destroy_node()


def put(node, **values):
    return node.set_parameters_atomically([RosParameter(n, value=v) for n, v in values.items()])


def test_defaults_and_values_at_the_start(make):
    _, parameters = make(rate=25, device=12345, offsets=[1, 2])
    assert parameters.values() == {'rate': 25.0, 'device': '12345', 'width': 640, 'offsets': [1.0, 2.0], 'autostart': True}
    assert isinstance(parameters['rate'], float)
    assert parameters.problems == {}


def test_wrong_values_at_the_start_are_reported_and_leave_the_defaults(make):
    node, parameters = make(rate=math.nan, width=0, device=True)
    assert parameters.values()['rate'] == 30.0 and parameters['width'] == 640
    assert set(parameters.problems) == {'rate', 'width', 'device'}
    assert parameters.problems['width'] == 'parameter width is 0, but must be int, 1 to 4096 px'
    assert put(node, width=320).successful
    assert set(parameters.problems) == {'rate', 'device'}


@pytest.mark.parametrize('values', [{'rate': 101.0}, {'rate': 'fast'}, {'width': -1}, {'autostart': False}, {'rate': 20.0, 'width': 0}])
def test_a_wrong_value_changes_nothing(make, values):
    applied = []
    node, parameters = make(apply=applied.append)
    result = put(node, **values)
    assert not result.successful and result.reason
    assert parameters['rate'] == 30.0 and parameters['width'] == 640 and applied == []


def test_check_sees_changes_before_and_apply_after(make):
    seen = []
    node, parameters = make(check=lambda c: seen.append(('check', c, parameters['rate'])),
                            apply=lambda c: seen.append(('apply', c, parameters['rate'])))
    assert put(node, rate=50, device='pad').successful
    assert seen == [('check', {'rate': 50.0, 'device': 'pad'}, 30.0), ('apply', {'rate': 50.0, 'device': 'pad'}, 50.0)]


GOOD = CaptureStatus('running', 300, 2, 1, 29.9, 0.02, '')
ABOUT = {'source': 'device', 'path': '/dev/video0', 'serial': 'A111', 'rate': 30.0}


def test_a_camera_that_runs():
    health = capture_health(GOOD, ABOUT, True, '')
    assert (health.level, health.message) == (OK, '29.9 Hz')
    assert health.values['rate (Hz)'] == 29.9 and health.values['dropped'] == 2 and health.values['corrupt'] == 1
    assert health.values['device'] == '/dev/video0' and health.values['age (s)'] == 0.02


@pytest.mark.parametrize(('change', 'level', 'said'), [
    ({'rate': 14.0}, WARN, '14.0 Hz instead of 30.0 Hz'), ({'age_s': 3.0}, ERROR, 'no frame for 3.0 s'),
    ({'failing': True, 'error': 'torn', 'age_s': 3.0}, ERROR, 'torn'),
    ({'state': 'lost', 'error': 'pulled out'}, ERROR, 'pulled out'), ({'state': 'failed', 'error': 'gone'}, ERROR, 'gone'),
    ({'left_out': 0.25}, WARN, '25 % of the frames are skipped'), ({'left_out': 0.01}, OK, '29.9 Hz'),
    ({'state': 'ended'}, OK, 'is over'), ({'state': 'paused'}, OK, 'not active'),
    ({'rate': math.nan, 'age_s': math.nan}, OK, 'waiting for the first frame')])
def test_what_goes_wrong_is_said(change, level, said):
    health = capture_health(replace(GOOD, **change), ABOUT, True, '')
    assert health.level == level and said in health.message


def test_a_recordings_rate_is_no_complaint():
    assert capture_health(replace(GOOD, rate=3.0, age_s=20.0), ABOUT, False, '').level == OK


def test_without_a_source():
    assert unconfigured_health('', False).level == OK
    missing = unconfigured_health('no such device', True)
    assert missing.level == ERROR and 'retries' in missing.message and missing.values['last error'] == 'no such device'


def test_topics_that_nobody_wants_are_no_complaint():
    health = capture_health(replace(GOOD, age_s=30.0, rate=0.0), {**ABOUT, 'idle': True}, True, '')
    assert (health.level, health.message) == (OK, 'nobody subscribes')


def fed(monkeypatch, rate=1000, level=1.0, since=0.0):
    """A meter that was given 5 s of samples, since s ago."""
    now = [100.0]
    monkeypatch.setattr(module.time, 'monotonic', lambda: now[0])
    meter = SampleMeter(4.9)
    for _ in range(1000):
        now[0] += 5 / rate
        meter.add(np.full((5, 4), level))
    now[0] += since
    return meter


def test_a_rate_of_samples_and_their_saturation_are_measured(monkeypatch):
    meter, about = fed(monkeypatch), {'crc errors': 3, 'rate': 1000.0}
    assert meter.rate == pytest.approx(1000, rel=0.01)
    health = capture_health(GOOD, about, True, '', meter=meter)
    assert (health.level, health.values['crc errors'], health.values['samples'], health.values['saturated (%)']) == (OK, 3, 5000, 0)
    assert 'saturated' in capture_health(GOOD, {}, True, '', meter=fed(monkeypatch, level=4.95)).message
    assert capture_health(GOOD, {'rate': 2000.0}, True, '', meter=meter).level == WARN
    assert capture_health(GOOD, about, True, '', meter=fed(monkeypatch, since=10.0)).message.startswith('waiting'), 'of long ago'
