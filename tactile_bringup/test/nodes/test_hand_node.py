# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""hand_node: frames that do not move as listeners that come later get them, frames of joints that move, and the contacts of all sensors."""
import itertools

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, PoseWithCovarianceStamped, Vector3
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Header, String
from tf2_msgs.msg import TFMessage

from tactile_bringup.nodes.hand_node import HandNode
from tactile_driver.errors import BadArgument
from tactile_driver.nodes.runtime.host import Host
from tactile_msgs.msg import Contact, ContactRegion, Contacts, HandContacts

HAND = 'sensors:\n  - {name: left/thumb, type: touchpad, parent: palm, xyz: [0.1, 0.2, 0.3], quaternion: [0, 0.6, 0, 0.8]}\n' \
       '  - {name: index, type: psd_finger}\n'


def test_mountings_are_latched_under_the_names_of_the_file(bench, tmp_path):
    (tmp_path / 'hand.yaml').write_text(HAND)
    other, until = bench(lambda: HandNode(Host(parameters={'hand': f'{tmp_path}/hand.yaml'})))
    found, reports = [], []
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    other.create_subscription(TFMessage, '/tf_static', found.append, latched)
    other.create_subscription(DiagnosticArray, '/diagnostics', reports.append, 10)
    assert until(lambda: found)
    thumb, index = found[0].transforms
    assert (thumb.header.frame_id, thumb.child_frame_id) == ('palm', 'left_thumb')
    assert (index.header.frame_id, index.child_frame_id) == ('hand', 'index')
    position, turned = thumb.transform.translation, thumb.transform.rotation
    assert (position.x, position.y, position.z) == (0.1, 0.2, 0.3) and (turned.x, turned.y, turned.z, turned.w) == (0.0, 0.6, 0.0, 0.8)
    assert until(lambda: any(s.message == '2 sensors on hand' for m in reports for s in m.status))


FINGER = '''<robot name="r"><link name="palm"/><link name="finger"/><link name="tip"/>
<joint name="bend" type="revolute"><parent link="palm"/><child link="finger"/><axis xyz="0 1 0"/><limit lower="0" upper="1"/></joint>
<joint name="mount" type="fixed"><parent link="finger"/><child link="tip"/><origin xyz="0 0 0.1"/></joint>
<tactile_sensor name="tip" type="psd_finger" link="tip"/></robot>'''


@pytest.fixture
def finger(bench, tmp_path):
    """finger(**parameters) -> (other node, until): a hand_node of a sensor on a bending finger."""
    (tmp_path / 'hand.urdf').write_text(FINGER)
    return lambda **more: bench(lambda: HandNode(Host(parameters={'hand': f'{tmp_path}/hand.urdf', **more})))


def joints_at(node, position):
    message = JointState(name=['bend'], position=[position])
    message.header.stamp = node.get_clock().now().to_msg()
    return message


def test_a_finger_that_moves_carries_its_frame_and_its_contacts_along(finger):
    other, until = finger()
    moving, contacts, texts = [], [], []
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    other.create_subscription(TFMessage, '/tf', moving.append, 10)
    other.create_subscription(HandContacts, '/hand/contacts', contacts.append, 10)
    other.create_subscription(String, '/robot_description', texts.append, latched)
    joints, felt = other.create_publisher(JointState, '/joint_states', 10), other.create_publisher(Contacts, '/tip/contacts', 10)
    assert until(lambda: joints.get_subscription_count() and felt.get_subscription_count() and texts)
    assert texts[0].data == FINGER

    def move(position):
        joints.publish(joints_at(other, position))
        contact = Contact(id=7, position=Point(x=0.01), normal=Vector3(z=1.0), position_covariance=np.diag([1e-6, 4e-6, 9e-6]).ravel())
        felt.publish(Contacts(header=Header(stamp=other.get_clock().now().to_msg(), frame_id='tip'), contacts=[contact]))
        return contacts and contacts[-1].contacts and np.isfinite(contacts[-1].contacts[0].position.x)
    assert until(lambda: move(np.pi / 2) and moving)
    transform = moving[-1].transforms[0]
    assert (transform.header.frame_id, transform.child_frame_id) == ('palm', 'finger')
    assert transform.transform.rotation.y == pytest.approx(np.sin(np.pi / 4))
    found = contacts[-1]
    assert found.header.frame_id == 'palm' and found.sensors == ['tip']
    contact = found.contacts[0]
    assert contact.id == 7
    assert (contact.position.x, contact.position.y, contact.position.z) == pytest.approx((0.1, 0, -0.01))
    assert (contact.normal.x, contact.normal.z) == pytest.approx((1, 0), abs=1e-9)
    assert np.diag(np.reshape(contact.position_covariance, (3, 3))) == pytest.approx([9e-6, 4e-6, 1e-6])


def test_a_joint_that_is_not_published_is_reported_and_its_contacts_have_no_position(finger):
    other, until = finger()
    contacts, reports = [], []
    other.create_subscription(HandContacts, '/hand/contacts', contacts.append, 10)
    other.create_subscription(DiagnosticArray, '/diagnostics', reports.append, 10)
    felt = other.create_publisher(Contacts, '/tip/contacts', 10)
    message = Contacts(header=Header(stamp=other.get_clock().now().to_msg()), contacts=[Contact(force=2.0)])
    assert until(lambda: felt.publish(message) or contacts)
    assert np.isnan(contacts[-1].contacts[0].position.x) and contacts[-1].contacts[0].force == 2.0
    expected = 'joint bend, which moves sensor tip, has no present position on /joint_states'
    assert until(lambda: any(expected in status.message for report in reports for status in report.status))


def test_simulated_joints_move_between_their_limits_until_a_driver_publishes(finger):
    other, until = finger(simulated_joints=True)
    seen = []
    other.create_subscription(JointState, '/joint_states', seen.append, 10)
    assert until(lambda: len(seen) > 5) and all(0 <= message.position[0] <= 1 for message in seen)
    driver = other.create_publisher(JointState, '/joint_states', 10)
    assert until(lambda: driver.publish(joints_at(other, 0.5)) or [message.position[0] for message in seen[-5:]] == [0.5] * 5)


def felt_at(other, name, moved):
    """The messages of a sensor that an object touches, which it has moved over by `moved` m along y, as an array sees it."""
    header = Header(stamp=other.get_clock().now().to_msg(), frame_id=name)
    contact = Contact(id=1, position=Point(y=moved, z=np.nan), position_covariance=np.diag([1e-10, 1e-10, np.nan]).ravel())
    return Contacts(header=header, contacts=[contact]), ContactRegion(header=header, orientation=np.nan, motion_interval=np.nan)


def test_the_pose_of_a_held_object_is_published_while_somebody_subscribes(bench, tmp_path):
    (tmp_path / 'hand.yaml').write_text('sensors:\n  - {name: left, type: taxel_array, xyz: [0, 0, -0.02]}\n'
                                        '  - {name: right, type: taxel_array, xyz: [0, 0, 0.02], rpy: [0, 3.141592653589793, 0]}\n')
    other, until = bench(lambda: HandNode(Host(parameters={'hand': f'{tmp_path}/hand.yaml', 'publish_frames': False})))
    outs = [[(name, other.create_publisher(kind, f'/{name}/{topic}', 10)) for kind, topic in
             ((Contacts, 'contacts'), (ContactRegion, 'contact_region'))] for name in ('left', 'right')]
    assert until(lambda: other.count_publishers('/hand/object')) and other.count_publishers('/tf') == 0
    poses, frames, moved, turns = [], [], [0.0], itertools.cycle(range(20))
    subscription = other.create_subscription(PoseWithCovarianceStamped, '/hand/object', poses.append, 10)
    other.create_subscription(TFMessage, '/tf', frames.append, 10)

    def feel():
        if next(turns):  # the executor handles one message or timer a turn
            return
        for sensor in outs:
            for (name, publisher), message in zip(sensor, felt_at(other, sensor[0][0], moved[0])):
                publisher.publish(message)
    assert until(lambda: feel() or poses)
    moved[0] = 1e-3
    assert until(lambda: feel() or poses[-1].pose.pose.position.y > 0.9e-3)
    found = poses[-1]
    assert found.header.frame_id == 'hand' and found.pose.pose.position.y == pytest.approx(1e-3, rel=0.01)
    assert np.sqrt(found.pose.covariance[7]) == pytest.approx(1e-5, rel=0.1) and np.sqrt(found.pose.covariance[0]) < 1e-4
    assert until(lambda: frames) and frames[-1].transforms[0].child_frame_id == 'object'
    other.destroy_subscription(subscription)
    assert until(lambda: other.count_publishers('/tf') == 0)


def test_beside_robot_state_publisher_it_publishes_no_frame(finger):
    other, until = finger(publish_frames=False)
    assert until(lambda: other.count_publishers('/hand/contacts'))
    assert other.count_publishers('/tf') == other.count_publishers('/tf_static') == other.count_publishers('/robot_description') == 0


def test_without_a_file_it_says_what_is_missing():
    rclpy.init()
    try:
        with pytest.raises(BadArgument, match='hand'):
            HandNode()
    finally:
        rclpy.try_shutdown()
