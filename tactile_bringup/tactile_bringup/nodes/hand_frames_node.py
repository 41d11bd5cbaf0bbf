# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""hand_frames_node: publishes the mounting poses of a hand's sensors on /tf_static, and what carries them as hand_markers for RViz."""
from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from geometry_msgs.msg import Point, Quaternion, TransformStamped, Vector3
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from std_msgs.msg import ColorRGBA
from tactile_driver.errors import BadArgument
from tactile_driver.nodes.messages.conversions import vector
from tactile_driver.nodes.runtime.defect_guard import guard_services
from tactile_driver.nodes.runtime.diagnostics import OK, Health, NodeDiagnostics, common_values
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.nodes.runtime.run import run_node
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from ..hand.description import Hand, read_hand
from ..parameters.table import HAND_FRAMES_PARAMETERS

_BEHIND, _THICK = 0.04, 0.012  # m, chosen: below a palm of sheets, thinner than a finger
_GREY = ColorRGBA(r=0.45, g=0.46, b=0.5, a=1.0)


def body_markers(hand: Hand) -> MarkerArray:
    """Rods in the parent frame of each sensor, of stamp 0, for which RViz takes the newest transforms."""
    made = []
    for sensor in hand.sensors:
        place = np.array(sensor.xyz)
        corner = place - _BEHIND * _outwards(np.array(sensor.quaternion))
        for start, end in ((np.array([0.0, 0.0, -_BEHIND]), corner), (corner, place)):
            if np.linalg.norm(end - start) > _THICK:
                made.append(_rod(start, end))
                made[-1].header.frame_id, made[-1].id = sensor.parent, len(made)
    return MarkerArray(markers=made)


def _outwards(quaternion: np.ndarray) -> np.ndarray:
    """The z axis (3,) of a frame that a quaternion x, y, z, w turns. scipy.spatial would take a second of each start."""
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array([2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)])


def _rod(start: np.ndarray, end: np.ndarray) -> Marker:
    """A cylinder between two places (3,), m."""
    length, middle = float(np.linalg.norm(end - start)), 0.5 * (start + end)
    rod = Marker(ns='body', type=Marker.CYLINDER, scale=Vector3(x=_THICK, y=_THICK, z=length), color=_GREY)
    x, y, z = (end - start) / length
    turn = np.array([-y, x, 0.0, 1 + z]) if z > -1 + 1e-9 else np.array([1.0, 0.0, 0.0, 0.0])  # from the z axis by the shortest way
    turn /= np.linalg.norm(turn)
    rod.pose.position = Point(x=middle[0], y=middle[1], z=middle[2])
    rod.pose.orientation = Quaternion(x=turn[0], y=turn[1], z=turn[2], w=turn[3])
    return rod


def mounting_transforms(hand: Hand, stamp: Time) -> list[TransformStamped]:
    """Transforms from the parent frame of each sensor to its sensor frame."""
    found = []
    for sensor in hand.sensors:
        mounting = TransformStamped(child_frame_id=sensor.frame)
        mounting.header.frame_id, mounting.header.stamp = sensor.parent, stamp.to_msg()
        mounting.transform.translation = vector(sensor.xyz)
        mounting.transform.rotation = Quaternion(**dict(zip('xyzw', sensor.quaternion)))
        found.append(mounting)
    return found


class HandFramesNode(Node):
    """Publishes once, latched, in one process; static_transform_publisher of tf2_ros needs a process per sensor."""

    def __init__(self, host: Host | None = None):
        super().__init__('hand_frames_node', **(host or Host()).options)
        settings = NodeParameters(self, HAND_FRAMES_PARAMETERS)
        if settings.problems or not settings['hand']:
            raise BadArgument('hand_frames_node: ' + ('; '.join(settings.problems.values()) or 'parameter hand is empty; name the file'))
        self._hand = read_hand(Path(settings['hand']))
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._output = self.create_publisher(TFMessage, '/tf_static', latched)
        self._output.publish(TFMessage(transforms=mounting_transforms(self._hand, self.get_clock().now())))
        self._body = self.create_publisher(MarkerArray, 'hand_markers', latched)
        self._body.publish(body_markers(self._hand))
        self._diagnostics = NodeDiagnostics(self, 'frames', self._hand.frame, self._examine)
        guard_services(self)

    def _examine(self) -> Health:
        return Health(OK, f'{len(self._hand.sensors)} sensors on {self._hand.frame}', common_values('running'))


def main(args: list[str] | None = None) -> None:
    """Run the process hand_frames_node."""
    sys.exit(run_node(HandFramesNode, args))


if __name__ == '__main__':
    main()
