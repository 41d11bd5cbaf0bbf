# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The contacts of all sensors of a hand in its root frame, on /hand/contacts."""
from __future__ import annotations

from copy import copy

import numpy as np
from geometry_msgs.msg import Point, Vector3
from rclpy.node import Node

from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.ros_defaults import steady_timer
from tactile_msgs.msg import Contact, Contacts, HandContacts

from ..hand.description import Hand, HandSensor
from .constants import BRINGUP
from .hand_joints import JointPositions
from .hand_publisher import HandPublisher

_UNKNOWN_POSE = np.full((3, 3), np.nan), np.full(3, np.nan)


class HandContactsPublisher(HandPublisher):
    """Publishes the contacts of all sensors in the hand's root frame."""

    kind, topic, inputs, depth = HandContacts, '/hand/contacts', {'contacts': Contacts}, 1

    def __init__(self, node: Node, host: Host, hand: Hand, positions: JointPositions):
        self._latest: dict[str, Contacts] = {}
        self._is_new = False
        super().__init__(node, host, hand, positions)
        steady_timer(node, 1.0 / BRINGUP.hand_contacts_rate, self._publish)

    def _end(self) -> None:
        self._latest, self._is_new = {}, False

    def _take(self, sensor: HandSensor, message: Contacts, _received_ns: int) -> None:
        self._latest[sensor.name], self._is_new = message, True

    def _publish(self) -> None:
        if not self._is_new:
            return
        self._is_new = False
        newest = max(self._latest.values(), key=lambda message: stamp_ns_of(message.header))
        found = HandContacts()
        found.header.stamp, found.header.frame_id = newest.header.stamp, self._hand.frame
        for sensor in self._hand.sensors:
            message = self._latest.get(sensor.name)
            if message is None or not message.contacts:
                continue
            if stamp_ns_of(newest.header) - stamp_ns_of(message.header) <= BRINGUP.max_contacts_age_ns:
                rotation, origin = self._pose(sensor, stamp_ns_of(message.header))
                found.contacts += [transformed(contact, rotation, origin) for contact in message.contacts]
                found.sensors += [sensor.name] * len(message.contacts)
        self._publisher.publish(found)

    def _pose(self, sensor: HandSensor, stamp_ns: int) -> tuple[np.ndarray, np.ndarray]:
        """Rotation matrix (3, 3) and origin (3,), m, of the sensor frame in the hand's root frame; NaN where a joint's position or the
        parent frame is unknown."""
        pose = self._hand.pose(sensor, self._positions.at(stamp_ns))
        return _UNKNOWN_POSE if pose is None else (pose[0].as_matrix(), pose[1])


def transformed(contact: Contact, rotation: np.ndarray, origin: np.ndarray) -> Contact:
    """A contact in another frame, in which the present frame has a pose: rotation (3, 3), origin (3,), m."""
    found, p, n = copy(contact), contact.position, contact.normal
    x, y, z = (rotation @ [p.x, p.y, p.z] + origin).tolist()
    found.position = Point(x=x, y=y, z=z)
    x, y, z = (rotation @ [n.x, n.y, n.z]).tolist()
    found.normal = Vector3(x=x, y=y, z=z)
    found.position_covariance = (rotation @ np.reshape(contact.position_covariance, (3, 3)) @ rotation.T).ravel()
    return found
