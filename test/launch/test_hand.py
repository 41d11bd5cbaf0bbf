# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""hand.launch.py: results of several simulated sensors at once, recording, a process that dies, shutdown, replay."""
import os
import signal

import numpy as np
import psutil
import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

from tactile_bringup import share
from tactile_bringup.hand.description import read_hand
from tactile_bringup.nodes.hand_joints import JointPositions
from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_msgs.msg import ContactRegion, Contacts, HandContacts

HAND = {'sensors': [{'name': 'left/pad', 'type': 'taxel_array', 'xyz': [0.1, 0.0, 0.0], 'rate': 50},
                    {'name': 'tip', 'type': 'psd_finger', 'parent': 'left_pad', 'rate': 500}]}
TOPICS = {'/left/pad/contact_region': ContactRegion, '/left/pad/contacts': Contacts, '/tip/contacts': Contacts}
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.fixture
def hand(tmp_path):
    (tmp_path / 'hand.yaml').write_text(yaml.safe_dump(HAND))
    return 'hand:=hand.yaml'


def sensor_process(launched, name):
    """The process of a sensor."""
    children = psutil.Process(launched.process.pid).children(recursive=True)
    return next(child for child in children if f'__ns:=/{name}' in child.cmdline())


def test_a_hand_is_recorded_a_sensor_that_dies_comes_back_and_the_recording_is_played(ros2, listen, hand, tmp_path):
    launched = ros2('launch', 'tactile_bringup', 'hand.launch.py', hand, 'record:=bags')
    ear = listen({**TOPICS, '/diagnostics': DiagnosticArray})
    positions = []
    ear.node.create_subscription(TFMessage, '/tf_static', positions.append, LATCHED)
    assert ear.wait_for(lambda: all(len(ear.heard[topic]) > 20 for topic in TOPICS), 120), launched.log

    def mounted():
        return {t.child_frame_id: t.header.frame_id for message in list(positions) for t in message.transforms}
    assert ear.wait_for(lambda: mounted().keys() >= {'left_pad', 'tip', 'tip_tip'}, 120), launched.log
    assert mounted()['left_pad'] == 'hand' and mounted()['tip'] == 'left_pad' and mounted()['tip_tip'] == 'tip'

    def said():
        return {status.name.split(':')[0]: {v.key for v in status.values} for message in list(ear.heard['/diagnostics'])
                for status in message.status if status.values}
    assert ear.wait_for(lambda: len(said()) == 9, 120), launched.log
    assert set(said()) == {
        '/hand_node', '/tip/psd_node', '/tip/psd_contact_node', '/tip/finger_markers_node', '/tip/record_node',
        '/left/pad/taxel_array_node', '/left/pad/taxel_contact_node', '/left/pad/taxel_markers_node', '/left/pad/record_node'}
    assert all({'state', 'rate (Hz)', 'age (s)', 'dropped', 'what to do'} <= keys for keys in said().values())
    assert launched.complaints == [], launched.log
    os.kill(sensor_process(launched, 'tip').pid, signal.SIGKILL)
    assert ear.wait_for(lambda: 'exit code -9' in launched.log, 120), launched.log
    before = len(ear.heard['/tip/contacts'])
    assert ear.wait_for(lambda: len(ear.heard['/tip/contacts']) > before + 20, 120), launched.log
    others = ear.stamps('/left/pad/contacts')
    assert others == sorted(set(others)), 'the other continues'
    ear.close()
    assert launched.interrupt() in (0, 1), 'our launch verb counts a process that was killed as failed'
    assert 'Traceback' not in launched.log
    assert {path.name for path in (tmp_path / 'bags').iterdir()} == {'left_pad', 'tip'}

    played = ros2('launch', 'tactile_bringup', 'hand.launch.py', hand, 'source:=bag', 'path:=bags')
    ear = listen(TOPICS)
    assert ear.wait_for(lambda: all(len(ear.heard[topic]) > 10 for topic in TOPICS), 120), played.log
    assert {message.header.frame_id for message in list(ear.heard['/left/pad/contacts'])} == {'left_pad'}
    assert played.wait(120) == 0, played.log
    assert played.log.count('the recording is over') == 1, played.log
    assert played.complaints == [], played.log


@pytest.mark.slow
@pytest.mark.parametrize('composed', ['true', 'false'])
def test_the_example_hand_tells_all_it_feels(ros2, listen, composed):
    launched = ros2('launch', 'tactile_bringup', 'hand.launch.py', f'composed:={composed}')
    ear = listen({f'/{name}/contacts': Contacts for name in ('thumb', 'index', 'middle', 'little', 'palm')})
    assert ear.wait_for(lambda: all(len(messages) > 100 for messages in ear.heard.values()), 120), launched.log
    assert launched.interrupt() == 0, launched.log
    assert launched.complaints == []


@pytest.mark.slow
@pytest.mark.parametrize(('name', 'sensors'), [('gripper', ('array', 'pad')),
                                               ('three_fingers', ('thumb_pad', 'index_pad', 'ring_tip', 'ring_array', 'palm'))])
def test_a_moved_joint_carries_the_contacts_of_each_example_along(ros2, listen, name, sensors):
    launched = ros2('launch', 'tactile_bringup', 'hand.launch.py', f'description:={share("urdf", f"{name}.urdf.xacro")}')
    ear = listen({'/hand/contacts': HandContacts, '/joint_states': JointState, **{f'/{sensor}/contacts': Contacts for sensor in sensors}})
    hand, positions = read_hand(share('urdf', f'{name}.urdf.xacro')), JointPositions()
    given, errors, moved = {}, {sensor: [] for sensor in sensors}, {sensor: [] for sensor in sensors}

    def compare():
        """Each contact in the hand's frame with that of its sensor at the joint positions of its stamp."""
        for message in drained(ear.heard['/joint_states']):
            positions.add(message)
        for sensor in hand.sensors:
            for message in drained(ear.heard[f'/{sensor.name}/contacts']):
                joints = positions.at(stamp_ns_of(message.header))
                if set(hand.robot.positioned) <= set(joints):
                    rotation, origin = hand.pose(sensor, joints)
                    moved[sensor.name].append(origin)
                    given[sensor.name] = [rotation.apply(numbers_of(each.position)) + origin for each in message.contacts]
        for message in drained(ear.heard['/hand/contacts']):
            for sensor, contact in zip(message.sensors, message.contacts, strict=True):
                if given.get(sensor) and np.isfinite(numbers_of(contact.position)).all():
                    errors[sensor].append(min(np.linalg.norm(numbers_of(contact.position) - each) for each in given[sensor]))
        return all(len(found) > 100 for found in errors.values())
    assert ear.wait_for(compare, 120), (launched.log, {sensor: len(found) for sensor, found in errors.items()})
    carried = [sensor.name for sensor in hand.sensors if np.ptp(moved[sensor.name], axis=0).max() > 0.01]
    assert len(carried) == {'gripper': 2, 'three_fingers': 4}[name], 'the palm stays'
    for sensor in sensors:
        assert np.median(errors[sensor]) < 2e-3, 'within the motion between two messages'
    assert launched.interrupt() == 0, launched.log
    assert launched.complaints == []


def drained(messages):
    """The messages that have come since the last call."""
    found = list(messages)
    del messages[:len(found)]
    return found


def numbers_of(point):
    return np.array([point.x, point.y, point.z])
