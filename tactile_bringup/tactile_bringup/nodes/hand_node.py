# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""hand_node: the frames of a hand's sensors on /tf and /tf_static, the contacts of all of them on /hand/contacts, and the pose of the held
object on /hand/object."""
from __future__ import annotations

from pathlib import Path

from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from tactile_driver.errors import BadArgument
from tactile_driver.nodes.messages.conversions import static_transform
from tactile_driver.nodes.runtime.defect_guard import guard_services
from tactile_driver.nodes.runtime.diagnostics import ERROR, OK, Health, NodeDiagnostics, common_values
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.nodes.runtime.ros_defaults import LATCHED_QOS, STREAM_QOS
from tactile_driver.nodes.runtime.run import process_of

from ..hand.description import read_hand
from ..parameters.table import HAND_PARAMETERS
from .constants import BRINGUP
from .hand_contacts import HandContactsPublisher
from .hand_joints import TOPIC, JointPositions, SimulatedJoints
from .hand_object import HandObjectPublisher


class HandNode(Node):
    """Publishes the mounting poses of a hand's sensors, latched, from one process; static_transform_publisher needs a process per sensor.

    Of a hand with a URDF it publishes all links as robot_state_publisher does, unless that is there (`publish_frames` is false).
    """

    def __init__(self, host: Host | None = None):
        host = host or Host()
        super().__init__('hand_node', **host.options)
        settings = NodeParameters(self, HAND_PARAMETERS)
        if settings.problems or not settings['hand']:
            raise BadArgument('hand_node: ' + ('; '.join(settings.problems.values()) or 'parameter hand is empty; name the file'))
        self._hand = read_hand(Path(settings['hand']))
        self._positions, robot = JointPositions(), self._hand.robot
        self._publishes = settings['publish_frames']
        if robot is not None and robot.positioned:
            self._subscription = self.create_subscription(JointState, TOPIC, self._take_joints, QoSProfile(depth=20))
            self._moving = self.create_publisher(TFMessage, '/tf', STREAM_QOS) if self._publishes else None
            self._simulated = SimulatedJoints(self, robot) if settings['simulated_joints'] else None
        if self._publishes:
            self._publish_fixed()
        self._contacts = HandContactsPublisher(self, host, self._hand, self._positions)
        self._object = HandObjectPublisher(self, host, self._hand, self._positions, settings['object'])
        self._diagnostics = NodeDiagnostics(self, 'hand', self._hand.frame, self._examine)
        guard_services(self)

    def _publish_fixed(self) -> None:
        """The frames that do not move, and the URDF for those who draw it."""
        stamp, robot = self.get_clock().now().to_msg(), self._hand.robot
        self._fixed = self.create_publisher(TFMessage, '/tf_static', LATCHED_QOS)
        if robot is None:
            transforms = [static_transform(sensor.parent, sensor.frame, sensor.xyz, sensor.quaternion, stamp)
                          for sensor in self._hand.sensors]
        else:
            transforms = [static_transform(joint.parent, joint.child, joint.mounting[1], joint.mounting[0].as_quat(), stamp)
                          for joint in robot.joints.values() if not joint.is_movable]
            self._description = self.create_publisher(String, 'robot_description', LATCHED_QOS)
            self._description.publish(String(data=robot.text))
        self._fixed.publish(TFMessage(transforms=transforms))

    def _take_joints(self, message: JointState) -> None:
        self._positions.add(message)
        if not self._publishes:
            return
        known = self._positions.newest()
        named, transforms = set(message.name), []
        for joint in self._hand.robot.joints.values():
            if joint.is_movable and joint.source in named and joint.source in known:
                rotation, origin = joint.pose({joint.source: known[joint.source][1]})
                transforms.append(static_transform(joint.parent, joint.child, origin, rotation.as_quat(), message.header.stamp))
        if transforms:
            self._moving.publish(TFMessage(transforms=transforms))

    def _examine(self) -> Health:
        unknown = self._unknown_joint()
        if unknown:
            return Health(ERROR, unknown, common_values('no joint positions'))
        return Health(OK, f'{len(self._hand.sensors)} sensors on {self._hand.frame}', common_values('running'))

    def _unknown_joint(self) -> str:
        """What is wrong with the first joint that moves a sensor and is not published now; '' if nothing is."""
        robot, newest, now = self._hand.robot, self._positions.newest(), self.get_clock().now().nanoseconds
        for sensor in self._hand.sensors if robot is not None else ():
            for joint in robot.chain(sensor.frame):
                if joint.is_movable and (joint.source not in newest or now - newest[joint.source][0] > BRINGUP.max_joint_age_ns):
                    return (f'joint {joint.source}, which moves sensor {sensor.name}, has no present position on /{TOPIC}; start the '
                            "hand's driver or its joint_state_broadcaster")
        return ''


main = process_of(HandNode)
