# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The pose of the held object in the hand's root frame, on /hand/object and as frame `object` on /tf."""
from __future__ import annotations

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped, Transform
from rclpy.node import Node
from rclpy.publisher import Publisher
from scipy.spatial.transform import Rotation
from tf2_msgs.msg import TFMessage

from tactile_driver.nodes.messages.conversions import point, stamp_ns_of, static_transform
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.ros_defaults import STREAM_QOS
from tactile_msgs.msg import Contact, ContactRegion, Contacts
from tactile_perception.core.messages import stamp_seconds
from tactile_perception.core.sensor_type import SENSOR_TYPES

from ..hand.description import Hand, HandSensor
from ..hand.held_pose import HeldPoseTracker, Report
from ..hand.urdf import Pose
from .constants import BRINGUP
from .hand_joints import JointPositions
from .hand_publisher import HandPublisher

FRAME, TOPIC = 'object', '/hand/object'


def report_of(contacts: Contacts, region: ContactRegion, pose: Pose | None, sensor_type: str) -> Report:
    """What a sensor reports by two messages of one stamp; pose: of its frame in the hand's."""
    known = {'area': region.area}
    if contacts.contacts:
        known |= {'position': np.mean([(one.position.x, one.position.y, one.position.z) for one in contacts.contacts], axis=0)}
    if len(contacts.contacts) == 1 and not contacts.contacts[0].flags & (Contact.AT_EDGE | Contact.AMBIGUOUS):
        known |= {'covariance': np.reshape(contacts.contacts[0].position_covariance, (3, 3)), 'orientation': region.orientation,
                  'elongation': region.major_axis - region.minor_axis}
    has_motion = SENSOR_TYPES[sensor_type].has_motion
    return Report(stamp_seconds(contacts.header), pose, bool(contacts.contacts), **known, has_motion=has_motion,
                  motion=_motion(region.motion) if has_motion else None, interval=region.motion_interval)


def _motion(message: Transform) -> Pose | None:
    moved, turned = message.translation, message.rotation
    numbers = np.array([moved.x, moved.y, moved.z, turned.x, turned.y, turned.z, turned.w])
    return (Rotation.from_quat(numbers[3:]), numbers[:3]) if np.isfinite(numbers).all() else None


class HandObjectPublisher(HandPublisher):
    """Follows the object, and publishes its pose while it is held. always: the frame is on /tf without a subscriber of /hand/object."""

    kind, topic, inputs = PoseWithCovarianceStamped, TOPIC, {'contacts': Contacts, 'contact_region': ContactRegion}
    depth = BRINGUP.waiting_stamps

    def __init__(self, node: Node, host: Host, hand: Hand, positions: JointPositions, always: bool = False):
        self._tracker = HeldPoseTracker(min(len(hand.sensors), 2))
        # Of each sensor, by stamp in ns, by type: messages without their counterpart.
        self._waiting: dict[str, dict[int, dict[type, Contacts | ContactRegion]]] = {}
        self._transforms: Publisher | None = None  # while the object is followed: without it there may be no publisher of frames here
        super().__init__(node, host, hand, positions, always)

    def _begin(self) -> None:
        self._transforms = self._node.create_publisher(TFMessage, '/tf', STREAM_QOS)

    def _end(self) -> None:
        self._node.destroy_publisher(self._transforms)
        self._waiting = {}
        self._tracker.release()

    def _take(self, sensor: HandSensor, message: Contacts | ContactRegion, _received_ns: int) -> None:
        """One of the two messages of a stamp; with the second one the object is followed."""
        waiting, stamp = self._waiting.setdefault(sensor.name, {}), stamp_ns_of(message.header)
        pair = waiting.setdefault(stamp, {})
        pair[type(message)] = message
        if len(pair) == 2:
            self._follow(sensor, pair[Contacts], pair[ContactRegion])
            self._waiting[sensor.name] = {later: other for later, other in waiting.items() if later > stamp}
        elif len(waiting) > BRINGUP.waiting_stamps:
            del waiting[min(waiting)]

    def _follow(self, sensor: HandSensor, contacts: Contacts, region: ContactRegion) -> None:
        pose = self._hand.pose(sensor, self._positions.at(stamp_ns_of(contacts.header)))
        self._tracker.take(sensor.name, report_of(contacts, region, pose, sensor.type))
        found = self._tracker.pose()
        if found is None:
            return
        quaternion = found.rotation.as_quat()
        message = PoseWithCovarianceStamped()
        message.header.stamp, message.header.frame_id = contacts.header.stamp, self._hand.frame
        message.pose.pose.position = point(found.position)
        turned = message.pose.pose.orientation
        turned.x, turned.y, turned.z, turned.w = quaternion.tolist()
        message.pose.covariance = found.covariance.ravel()
        self._publisher.publish(message)
        self._transforms.publish(TFMessage(transforms=[
            static_transform(self._hand.frame, FRAME, found.position, quaternion, contacts.header.stamp)]))
