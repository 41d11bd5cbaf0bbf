# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""simulated_stage: the tip of a simulated scene as a stage reports it: /tf of its probe, and the wrench of a force sensor above it."""
from __future__ import annotations

import numpy as np
from geometry_msgs.msg import PointStamped, WrenchStamped
from rclpy.node import Node
from scipy.spatial.transform import Rotation
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from tactile_driver.nodes.messages.conversions import static_transform
from tactile_driver.nodes.runtime.ros_defaults import LATCHED_QOS
from tactile_driver.nodes.runtime.run import process_of
from tactile_msgs.msg import Contacts
from tactile_perception.common.messages import wrench_to_message

from .constants import BRINGUP

BASE, PROBE, FORCE = 'stage_base', 'stage_tip', 'stage_force'
#: Position, m, and rotation vector, rad, of the sensor in BASE: not 0, so that frames that are confused show
MOUNTING = (0.30, -0.12, 0.05, 0.02, -0.01, 0.7)
_FORCE_ABOVE = np.array([0.0, 0.0, 0.08])  # m, of the force sensor above the tip, in the axes of BASE
_BIAS = np.array([0.4, -0.3, -2.1, 0.01, 0.02, -0.01])  # N, N m: weight of the tool and offset
_NOISE = np.array([0.01, 0.01, 0.01, 3e-4, 3e-4, 3e-4])  # N, N m: of a small force/torque sensor


class SimulatedStage(Node):
    """Follows ground_truth/tip and ground_truth/wrench; /tf_static joins their frame to that of the stage.

    With the parameter along_normal it follows the contacts of a finger, whose positions are on the undeformed surface, and their forces.
    """

    def __init__(self):
        super().__init__('simulated_stage')
        self._origin, self._turn = np.array(MOUNTING[:3]), Rotation.from_rotvec(MOUNTING[3:])
        self._tip, self._out, self._rng = np.array([0.0, 0.0, BRINGUP.start_height]), np.zeros(3), np.random.default_rng(5)
        self._transforms = self.create_publisher(TFMessage, '/tf', 100)
        self._mounted = self.create_publisher(TFMessage, '/tf_static', LATCHED_QOS)
        self._sensor = ''
        self._forces = self.create_publisher(WrenchStamped, '/stage/wrench', 100)
        if self.declare_parameter('along_normal', False).value:
            self.create_subscription(Contacts, 'ground_truth/contacts', self._follow_contact, 100)
        else:
            self.create_subscription(PointStamped, 'ground_truth/tip', self._follow_tip, 100)
            self.create_subscription(WrenchStamped, 'ground_truth/wrench', self._press, 100)

    def _follow_tip(self, message: PointStamped) -> None:
        p = message.point
        if np.isfinite(p.z):  # else it remains above the skin
            self._tip = np.array([p.x, p.y, p.z])
        self._publish_tip(message.header)

    def _follow_contact(self, message: Contacts) -> None:
        if message.contacts:
            p, n, depth = message.contacts[0].position, message.contacts[0].normal, message.contacts[0].depth
            outwards = np.array([n.x, n.y, n.z])
            self._tip, self._out = np.array([p.x, p.y, p.z]) - outwards * depth, outwards * (depth + BRINGUP.clearance)
            self._press(wrench_to_message(np.r_[-message.contacts[0].force * outwards, np.zeros(3)], message.header).message)
        else:  # it retreats along the same path
            self._tip, self._out = self._tip + self._out, np.zeros(3)
        self._publish_tip(message.header)

    def _publish_tip(self, header: Header) -> None:
        """Publish the position of the tip."""
        stamp = header.stamp
        if header.frame_id != self._sensor:
            self._sensor = header.frame_id
            mounted = static_transform(BASE, self._sensor, self._origin, self._turn.as_quat(), stamp)
            self._mounted.publish(TFMessage(transforms=[mounted]))
        tip = self._turn.apply(self._tip) + self._origin
        self._transforms.publish(TFMessage(transforms=[static_transform(BASE, PROBE, tip, stamp=stamp),
                                                       static_transform(PROBE, FORCE, _FORCE_ABOVE, stamp=stamp)]))

    def _press(self, message: WrenchStamped) -> None:
        """The reaction, in the frame and at the origin of the force sensor, with its offset and noise."""
        f, t = message.wrench.force, message.wrench.torque
        force, torque = self._turn.apply([f.x, f.y, f.z]), self._turn.apply([t.x, t.y, t.z])
        arm = self._turn.apply(self._tip) + _FORCE_ABOVE
        measured = -np.r_[force, torque - np.cross(arm, force)] + _BIAS + self._rng.normal(size=6) * _NOISE
        self._forces.publish(wrench_to_message(measured, Header(stamp=message.header.stamp, frame_id=FORCE)).message)


main = process_of(SimulatedStage)
