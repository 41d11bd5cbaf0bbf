# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What no check foresaw is counted and logged with its traceback; requests that cannot be met are answered."""
import pytest
import rclpy
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.lifecycle import LifecycleNode
from tactile_driver.nodes.runtime.defect_guard import DefectGuard, guard_services


class Log:
    """In place of a node and its logger."""

    def __init__(self):
        self.errors = []

    def get_logger(self):
        return self

    def error(self, text):
        self.errors.append(text)


def failed(log, net, error):
    try:
        raise error
    except Exception as caught:
        return net.catch(caught, 'dots')


def test_a_defect_is_counted_each_time_and_logged_once_with_its_traceback(monkeypatch):
    monkeypatch.setattr(DefectGuard, 'strict', False)
    log = Log()
    net = DefectGuard(log)
    told = [failed(log, net, IndexError('index 7')) for _ in range(3)]
    assert net.caught == 3 and 'dots' in told[0] and "IndexError('index 7')" in told[0]
    assert len(log.errors) == 1 and 'Traceback' in log.errors[0] and 'please report it' in log.errors[0]
    with pytest.raises(ZeroDivisionError) as other:
        1 / 0
    net.catch(other.value, 'dots')
    assert net.caught == 4 and len(log.errors) == 2, 'another line of code'


def test_tests_see_defects():
    assert DefectGuard.strict, 'set by conftest.py'
    with pytest.raises(IndexError):
        failed(None, DefectGuard(Log()), IndexError('index 7'))


@pytest.fixture
def services():
    rclpy.init()
    node = LifecycleNode('asked')
    node.declare_parameter('rate', 1.0)
    guard_services(node)
    yield {service.srv_type: service.callback for service in node.services}
    node.destroy_node()
    rclpy.shutdown()


def request(kind, type_):
    return kind.Request(parameters=[Parameter(name='rate', value=ParameterValue(type=type_, double_value=2.0))] * 2)


def test_parameters_of_a_type_that_does_not_exist_are_refused_with_a_reason(services):
    answer = services[SetParameters](request(SetParameters, 200), SetParameters.Response())
    assert [result.successful for result in answer.results] == [False, False] and '200' in answer.results[0].reason
    answer = services[SetParametersAtomically](request(SetParametersAtomically, 10), SetParametersAtomically.Response())
    assert not answer.result.successful and '10' in answer.result.reason


def test_others_are_set_as_ever(services):
    answer = services[SetParameters](request(SetParameters, 3), SetParameters.Response())
    assert [result.successful for result in answer.results] == [True, True]


def test_a_transition_that_the_state_does_not_allow_fails(services):
    asked = ChangeState.Request()
    asked.transition.id = 255
    assert not services[ChangeState](asked, ChangeState.Response()).success
    asked.transition.id = 1
    assert services[ChangeState](asked, ChangeState.Response()).success, 'configured'
