# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The SROS 2 policies: each node uses everything that its policy allows, and nothing else."""
import signal
import time
import xml.etree.ElementTree as Tree
from pathlib import Path

import pytest
from fault_rig import PATIENCE, Runner, made, planned
from rclpy.lifecycle import LifecycleNode
from rclpy.node import NodeNameNonExistentError
from rosidl_runtime_py.utilities import get_message

from tactile_bringup import share
from tactile_bringup.hand.description import read_hand
from tactile_bringup.nodes.hand_node import HandNode
from tactile_driver.nodes.runtime.host import Host
from tactile_perception.core.sensor_type import NODES, SENSOR_TYPES

FOLDER = Path(__file__).resolve().parents[2] / 'tactile_bringup' / 'sros'
SPACE = '/sensor'  # namespace of the policies
#: One type of those with the same nodes.
TYPES = sorted({(kind.driver, kind.perception, kind.view): name for name, kind in SENSOR_TYPES.items()}.values())
SENSOR_NODES = {*NODES, 'record_node'}
OF_GELS = {('subscribe', '/sensor/points')}  #: what the node that draws markers uses of sensors whose dots have no positions alone
#: What makes a node use all that it can.
MORE = {'taxel_contact_node': {'object.gravity_frame': 'world', 'gripper.joint': 'finger'}}


class Seen:
    """A node of another process, as one of this process sees it."""

    def __init__(self, by, name, space):
        self._by, self._name, self._space = by, name, space

    def get_name(self):
        return self._name

    def get_namespace(self):
        return self._space

    def __getattr__(self, name):
        def seen(*where):
            try:
                return getattr(self._by, name)(*where)
            except NodeNameNonExistentError:
                return []
        return seen


def used(node):
    """(kind of use, name) of all that a node uses, with the policies' namespace in place of its own."""
    where = node.get_name(), node.get_namespace()
    found = {('publish', name) for name, _ in node.get_publisher_names_and_types_by_node(*where)}
    found |= {('subscribe', name) for name, _ in node.get_subscriber_names_and_types_by_node(*where)}
    found |= {('reply', name) for name, _ in node.get_service_names_and_types_by_node(*where)}
    found |= {('request', name) for name, _ in node.get_client_names_and_types_by_node(*where)}
    own = node.get_namespace().rstrip('/') + '/'
    return {(kind, SPACE + '/' + name.removeprefix(own) if own != '/' and name.startswith(own) else name) for kind, name in found}


def allowed(executable):
    """The same as the policy says it."""
    profile, = Tree.parse(FOLDER / f'{executable}.policy.xml').getroot().findall('./enclaves/enclave/profiles/profile')
    return {(kind, entry.text) for rule in profile for kind in rule.attrib for entry in rule}


def agree(node):
    """Wait until the node uses what its policy allows: some it uses once somebody wants its results."""
    wanted, end = allowed(node.get_name()), time.monotonic() + PATIENCE
    while not used(node) <= wanted <= used(node) | OF_GELS and time.monotonic() < end:
        time.sleep(0.05)
    assert used(node) <= wanted <= used(node) | OF_GELS, {'not allowed': used(node) - wanted, 'not used': wanted - used(node)}


@pytest.fixture
def running(bench):
    """running(nodes): these, spun, with their drivers active, and somebody who wants all that they publish."""
    runners = []

    def start(nodes):
        runners.extend(Runner(node) for node in nodes)
        for node in nodes:
            if isinstance(node, LifecycleNode):
                node.trigger_configure()
                node.trigger_activate()
        for node in nodes:
            for topic, kinds in node.get_publisher_names_and_types_by_node(node.get_name(), node.get_namespace()):
                if topic.startswith(node.get_namespace().rstrip('/') + '/'):
                    bench.ear.node.create_subscription(get_message(kinds[0]), topic, lambda _message: None, 1)
        return nodes
    yield start
    for runner in runners:
        runner.end()


@pytest.mark.parametrize('sensor_type', TYPES)
def test_nodes_of_a_sensor_use_what_their_policies_allow_and_nothing_else(bench, running, sensor_type):
    plan = planned(sensor_type, bench.fresh('policed'))
    for node in running([made(plan, name, **MORE.get(name, {})) for name in plan.nodes]):
        agree(node)


def moving_copy(hand):
    """The URDF of a hand with the same sensors on a joint that moves."""
    joints = '<joint name="wrist" type="continuous"><parent link="arm"/><child link="hand"/></joint>'
    for sensor in hand.sensors:
        joints += f'<link name="{sensor.frame}"/><joint name="{sensor.frame}" type="fixed"><parent link="hand"/>' \
                  f'<child link="{sensor.frame}"/></joint><tactile_sensor name="{sensor.name}" type="{sensor.type}" link="{sensor.frame}"/>'
    return f'<robot name="r"><link name="arm"/><link name="hand"/>{joints}</robot>'


def test_the_frames_and_contacts_of_a_hand_do_so_too(running, tmp_path):
    (tmp_path / 'hand.urdf').write_text(moving_copy(read_hand(share('hands', 'example_hand.yaml'))))
    hand, = running([HandNode(Host([], {'hand': f'{tmp_path}/hand.urdf'}))])
    agree(hand)


def test_a_recorder_does_so_too(bench, tmp_path):
    space = bench.fresh('policed')
    process = bench.start('tactile_bringup', 'record_node', space, bag=tmp_path / 'bag', patience=0.0, pictures='true')
    agree(Seen(bench.ear.node, 'record_node', space))
    process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE) == 0


def test_every_node_has_a_policy_in_the_form_that_sros2_reads():
    files = sorted(FOLDER.glob('*.policy.xml'))
    assert [path.name.removesuffix('.policy.xml') for path in files] == sorted([*SENSOR_NODES, 'hand_node'])
    for path in files:
        root = Tree.parse(path).getroot()
        assert (root.tag, root.get('version')) == ('policy', '0.2.0')
        enclave, = root.findall('./enclaves/enclave')
        profile, = enclave.findall('./profiles/profile')
        name = path.name.removesuffix('.policy.xml')
        space = SPACE if name in SENSOR_NODES else ''
        assert enclave.get('path') == f'{space}/{name}' and (profile.get('ns'), profile.get('node')) == (space or '/', name)
        for rule in profile:
            assert (rule.tag, *rule.attrib.items()) in {('topics', ('publish', 'ALLOW')), ('topics', ('subscribe', 'ALLOW')),
                                                        ('services', ('reply', 'ALLOW')), ('services', ('request', 'ALLOW'))}
            assert {entry.tag for entry in rule} == {rule.tag[:-1]} and all('*' not in entry.text for entry in rule)
