# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The wrench of a gripper's object (paper taxel_array_image_processing, eqs 5 to 9): depth from the opening of the fingers, and the frame
of a force/torque sensor, as a live node receives them from /joint_states and tf."""
import itertools

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import TransformStamped, WrenchStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import Image, JointState
from tf2_msgs.msg import TFMessage
from waiting import until

from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.parameters.table import defaults
from tactile_msgs.msg import ContactRegion
from tactile_perception.core.errors import BadFrame
from tactile_perception.core.node import make_node
from tactile_perception.taxel.parameters import TAXEL_PARAMETERS
from tactile_perception.taxel.stage import TaxelStage

# An object of 30 mm and 4 N, in a gripper of which each finger moves by the joint: at 24.6 mm the pads are 29.2 mm apart.
OWN = {'reference.start': 'zero', 'object.width': 0.03, 'object.weight': 4.0, 'gripper.joint': 'finger', 'gripper.sign': 2.0,
       'gripper.zero': 0.010}
POSITION, DEPTH = 0.0246, 4e-4
TURN, PLACE = Rotation.from_rotvec([0.3, -0.8, 0.5]), np.array([0.01, -0.02, -0.03])


def image(stamp_s):
    values = np.zeros((44, 44), np.uint8)
    values[15:30, 20:40] = 100
    return image_to_message(Frame(values, 0, 'mono8'), '', header_of(round(stamp_s * 1e9), 'pad'))


def joints(stamp_s, position=POSITION, name='finger'):
    return JointState(header=header_of(round(stamp_s * 1e9), ''), name=['wrist', name], position=[1.0, position])


def mounted():
    """Pose of the pad in the frame of the force/torque sensor."""
    one = TransformStamped(child_frame_id='pad')
    one.header.frame_id = 'force_sensor'
    turn, at = one.transform.rotation, one.transform.translation
    turn.x, turn.y, turn.z, turn.w = TURN.as_quat()
    at.x, at.y, at.z = PLACE
    return TFMessage(transforms=[one])


def stage(**more):
    return TaxelStage({**defaults(TAXEL_PARAMETERS), **OWN, **more})


def numbers(message):
    f, t = message.wrench.force, message.wrench.torque
    return np.array([f.x, f.y, f.z, t.x, t.y, t.z])


def felt(it, stamp_s=1.0):
    """The wrench and the region of an image."""
    found = it.process(image(stamp_s))
    return numbers(found['wrench'][0]), found['contact_region'][0]


def test_depth_follows_from_the_opening_of_the_fingers():
    it = stage()
    it.take('/joint_states', joints(1.0))
    wrench, region = felt(it)
    assert wrench[2] == pytest.approx(-3e5 / 0.002 * DEPTH * region.area)
    assert wrench[:2] == pytest.approx([0.0, 2.0]) and np.isfinite(wrench).all() and it.health()[0] == ''
    it.take('/joint_states', joints(1.1, POSITION - 1e-4))  # each finger by 0.1 mm
    closer, region = felt(it, 1.1)
    assert closer[2] == pytest.approx(-3e5 / 0.002 * (DEPTH + 1e-4) * region.area)


def nothing(it):
    """Report nothing about the gripper."""


def another(it):
    it.take('/joint_states', joints(9.0, name='thumb'))


def old(it):
    it.take('/joint_states', joints(1.0))


def broken(it):
    with pytest.raises(BadFrame, match='finger'):
        it.take('/joint_states', joints(9.0, np.nan))


@pytest.mark.parametrize('say', [nothing, another, old, broken])
def test_without_a_joint_position_only_the_force_is_unknown(say):
    it = stage()
    say(it)
    wrench, region = felt(it, 9.0)
    assert np.isnan(wrench[2:5]).all() and wrench[:2] == pytest.approx([0.0, 2.0]) and region.area > 2e-4
    assert "joint 'finger'" in it.health()[0] and 'depth is NaN' in it.health()[0]


def test_a_contact_that_contradicts_the_opening_has_no_force():
    it = stage()
    it.take('/joint_states', joints(1.0, 0.03))
    assert np.isnan(felt(it)[0][2])
    it = stage(**{'object.width': 0.0})
    it.take('/joint_states', joints(1.0))
    assert np.isnan(felt(it)[0][2]) and 'object.width' in it.health()[0]


def test_without_a_transform_only_the_wrench_is_unknown():
    it = stage(wrench_frame='force_sensor')
    it.take('/joint_states', joints(1.0))
    wrench, region = felt(it)
    assert np.isnan(wrench).all() and region.area > 2e-4
    assert "from 'pad' to 'force_sensor'" in it.health()[0]
    it.take('/tf_static', mounted())
    assert np.isfinite(felt(it, 1.1)[0]).all() and it.health()[0] == ''


def test_an_unknown_component_affects_only_components_that_depend_on_it():
    it, link = stage(wrench_frame='force_sensor', **{'object.weight': 0.0}), mounted()
    turn = link.transforms[0].transform.rotation
    turn.x, turn.y, turn.z, turn.w = Rotation.from_rotvec([0, 0, np.pi / 2]).as_quat()
    it.take('/joint_states', joints(1.0))
    it.take('/tf_static', link)
    wrench = felt(it)[0]
    assert np.isfinite(wrench[2]) and np.isnan(wrench[:2]).all()


@pytest.fixture
def live():
    """A node with these parameters, and a peer that feeds it and receives its results."""
    rclpy.init()
    nodes = []

    def make(**parameters):
        nodes.extend([make_node('taxel_contact_node', Host(parameters=parameters)), rclpy.create_node('gripper')])
        executor = SingleThreadedExecutor()
        for node in nodes:
            executor.add_node(node)
        return nodes[1], executor
    yield make
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown()


def test_a_node_reports_the_wrench_at_the_force_torque_sensor(live):
    gripper, executor = live(**OWN, wrench_frame='force_sensor')
    heard = {'wrench': [], 'contact_region': []}
    for (topic, messages), kind in zip(heard.items(), (WrenchStamped, ContactRegion)):
        gripper.create_subscription(kind, topic, messages.append, 10)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    gripper.create_publisher(TFMessage, '/tf_static', latched).publish(mounted())
    images, states = gripper.create_publisher(Image, 'image_raw', 10), gripper.create_publisher(JointState, '/joint_states', 10)
    stamps = itertools.count(101)

    def felt_it():
        stamp_s = 0.01 * next(stamps)
        states.publish(joints(stamp_s))
        images.publish(image(stamp_s))
        return any(np.isfinite(numbers(message)).all() for message in heard['wrench'])
    assert until(felt_it, executor), heard
    executor.shutdown()
    reported = next(message for message in heard['wrench'] if np.isfinite(numbers(message)).all())
    assert reported.header.frame_id == 'force_sensor'
    # The same at the pad, moved by hand: what acts at the pad turns about the other origin too.
    alone = stage()
    alone.take('/joint_states', joints(1.0))
    at_pad, region = felt(alone)
    assert at_pad[2] == pytest.approx(-3e5 / 0.002 * DEPTH * region.area)
    force = TURN.apply(at_pad[:3])
    np.testing.assert_allclose(numbers(reported), np.r_[force, TURN.apply(at_pad[3:]) + np.cross(PLACE, force)], rtol=1e-5, atol=1e-9)
