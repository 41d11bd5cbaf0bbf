# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Requests and messages of any content, to nodes and sources."""
import random

import pytest
import rclpy
from fault_rig import made, planned
from fed_nodes import at, compressed, messages
from random_messages import hostile, random_message
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from std_srvs.srv import Trigger

from tactile_driver.errors import BadFrame
from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.nodes.topic_source import TopicSource

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
    request, names = kind.Request(), node.list_parameters([], 0).names
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


@pytest.mark.parametrize('count', [300, pytest.param(20_000, marks=[pytest.mark.slow, pytest.mark.timeout(3600)])])
def test_random_images_are_frames_or_refused(count):
    node, rng = rclpy.create_node('taker'), random.Random(4)
    source = TopicSource(node, 'camera/image_raw')
    images = [message for topic, message in messages('touchpad') if topic == 'image_raw']
    packed = [compressed(image, kind) for image in images for kind in ('.png', '.jpg')]
    stamp, bad = stamp_ns_of(images[-1].header), 0
    try:
        for number in range(count):
            stamp += 10_000_000
            good = at(images[number % len(images)], stamp)
            for message in (hostile(rng, good), hostile(rng, at(packed[number % len(packed)], stamp)), good):
                source._take(message, 0)
                try:
                    frame = source.read()
                except BadFrame as error:
                    bad += 1
                    assert message is not good and 'camera/image_raw' in str(error) or 'not a valid time' in str(error)
                    continue
                assert frame.image.dtype == 'uint8' and frame.image.size and frame.encoding in ('bgr8', 'mono8')
            assert (frame.stamp_ns, frame.image.tobytes()) == (stamp, good.data.tobytes())
            assert source.describe()['lost'] >= 0
    finally:
        source.close()
        node.destroy_node()
    assert 0.6 * count < bad < 2 * count
