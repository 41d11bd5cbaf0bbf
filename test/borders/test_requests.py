# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Requests of any content to every service of every node are answered, and all parameter values stay within their tables."""
import random

import pytest
from random_messages import hostile, random_message
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from fault_rig import made, planned
from std_srvs.srv import Trigger
from tactile_driver.nodes.runtime.parameter_server import NodeParameters

_COUNT = 60
_TYPES = [ParameterType.PARAMETER_NOT_SET, *range(1, 10), 10, 200, 255]


@pytest.fixture(scope='module', params=['touchpad', 'areal_dual', 'psd_finger', 'taxel_array'])
def nodes(request):
    """The nodes of a simulated sensor, whose driver waits to be configured."""
    plan = planned(request.param, f'/requests_{request.param}')
    found = [made(plan, name) for name in plan.nodes]
    yield found
    for node in found:
        node.destroy_node()


def asked(rng, node, kind):
    """A request with names of the node's own parameters, and values of any type."""
    request, names = kind.Request(), list(node._parameters)
    if hasattr(request, 'names'):
        request.names = [rng.choice(names)]
    if hasattr(request, 'parameters'):
        value = random_message(rng, ParameterValue)
        value.type = rng.choice(_TYPES)
        request.parameters = [Parameter(name=rng.choice([name for name in names if name != 'use_sim_time']), value=value)]
    return hostile(rng, request) if rng.random() < 0.4 else request


def test_any_request_is_answered_and_leaves_good_values(nodes):
    rng = random.Random(3)
    for node in nodes:
        settings = next(value for value in vars(node).values() if isinstance(value, NodeParameters))
        for service in list(node.services):
            for _ in range(_COUNT if service.srv_type is not Trigger else 5):
                request = asked(rng, node, service.srv_type)
                answer = service.callback(request, service.srv_type.Response())
                assert isinstance(answer, service.srv_type.Response)
                if hasattr(request, 'parameters') and hasattr(answer, 'results'):
                    assert len(answer.results) == len(request.parameters)
                    assert all(result.successful or result.reason for result in answer.results)
        for name, parameter in settings._table.items():
            assert repr(parameter.checked(settings[name])) == repr(settings[name]), name
            assert repr(parameter.checked(node.get_parameter(name).value)) == repr(settings[name]), name


def test_every_node_answers_set_reference_at_any_time(nodes):
    services = {service.srv_name.split('/')[-1]: service for node in nodes for service in node.services}
    answer = services['set_reference'].callback(Trigger.Request(), Trigger.Response())
    assert not answer.success and 'is being processed' in answer.message
