# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import math

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from tactile_driver.errors import BadArgument
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.parameters.table import Parameter

TABLE = (Parameter('rate', float, 30.0, 'Hz', 'frames a second', 0.0, 100.0), Parameter('device', str, '0', '', 'which'),
         Parameter('width', int, 640, 'px', 'of the image', 1, 4096), Parameter('places', list[float], [], 'm', 'where'),
         Parameter('autostart', bool, True, '', 'by itself', read_only=True))


@pytest.fixture(scope='module')
def context():
    context = Context()
    rclpy.init(context=context)
    yield context
    rclpy.shutdown(context=context)


@pytest.fixture
def make(context):
    """Makes (node, parameters) with values given at the start; destroys the nodes at the end."""
    nodes = []

    def with_values(check=None, apply=None, **values):
        node = Node('parameters_test', context=context, parameter_overrides=[RosParameter(n, value=v) for n, v in values.items()])
        nodes.append(node)
        return node, NodeParameters(node, TABLE, check, apply)
    yield with_values
    for node in nodes:
        node.destroy_node()


def put(node, **values):
    return node.set_parameters_atomically([RosParameter(n, value=v) for n, v in values.items()])


def test_defaults_and_values_at_the_start(make):
    _, parameters = make(rate=25, device=12345, places=[1, 2])
    assert parameters.values() == {'rate': 25.0, 'device': '12345', 'width': 640, 'places': [1.0, 2.0], 'autostart': True}
    assert isinstance(parameters['rate'], float)
    assert parameters.problems == {}


def test_wrong_values_at_the_start_are_told_and_leave_the_defaults(make):
    node, parameters = make(rate=math.nan, width=0, device=True)
    assert parameters.values()['rate'] == 30.0 and parameters['width'] == 640
    assert set(parameters.problems) == {'rate', 'width', 'device'}
    assert parameters.problems['width'] == 'parameter width is 0, but must be int, 1 to 4096 px'
    assert put(node, width=320).successful
    assert set(parameters.problems) == {'rate', 'device'}


def test_descriptors_carry_the_table(make):
    node, _ = make()
    rate, width = node.describe_parameter('rate'), node.describe_parameter('width')
    assert rate.description == 'frames a second' and rate.additional_constraints == 'float, 0 to 100 Hz'
    assert (rate.floating_point_range[0].to_value, width.integer_range[0].from_value) == (100.0, 1)
    assert node.describe_parameter('autostart').read_only


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


def test_check_can_refuse(make):
    def refuse(_changes):
        raise BadArgument('not now')
    node, parameters = make(check=refuse)
    result = put(node, rate=50.0)
    assert (result.successful, result.reason, parameters['rate']) == (False, 'not now', 30.0)
