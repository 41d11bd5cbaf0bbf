# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""finger_markers_node: what a PSD finger feels, for RViz: markers, and the place of its pole on /tf_static."""
from __future__ import annotations

import sys
import time

from geometry_msgs.msg import TransformStamped
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_system_default
from std_msgs.msg import Header
from tactile_driver.errors import BadArgument
from tactile_driver.nodes.parameter_server import NodeParameters
from tactile_driver.nodes.run import run_node
from tactile_msgs.msg import Contacts
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from ..parameters import FINGER_MARKERS_PARAMETERS
from .finger_markers import FingerMarkers

_QUEUE = QoSProfile(depth=200)


class FingerMarkersNode(Node):
    """Draws, while somebody looks, as often as an eye can follow."""

    def __init__(self):
        super().__init__('finger_markers_node')
        self._settings = NodeParameters(self, FINGER_MARKERS_PARAMETERS)
        if self._settings.problems:
            raise BadArgument('finger_markers_node: ' + '; '.join(self._settings.problems.values()))
        self._markers = FingerMarkers(self._settings)
        self._input, self._due_s = None, 0.0
        matched = PublisherEventCallbacks(matched=lambda _info: self._follow_demand())
        self._output = self.create_publisher(MarkerArray, 'markers', qos_profile_system_default, event_callbacks=matched)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._place_output = self.create_publisher(TFMessage, '/tf_static', latched)
        self._publish_pole()
        self._follow_demand()

    def destroy_node(self) -> None:
        """Take the markers away first."""
        if self.context.ok() and self._output.get_subscription_count():
            self._output.publish(self._markers.nothing(Header(frame_id=self._settings['frame_id'])))
        super().destroy_node()

    def _publish_pole(self) -> None:
        """The frame of the finger's tip, so that the sensor frame exists for RViz too."""
        frame = self._settings['frame_id']
        pole = TransformStamped(child_frame_id=frame + '_tip')
        pole.header.frame_id, pole.header.stamp = frame, self.get_clock().now().to_msg()
        pole.transform.translation.z = self._settings['radius']
        pole.transform.rotation.w = 1.0
        self._place_output.publish(TFMessage(transforms=[pole]))

    def _follow_demand(self) -> None:
        wanted = self._output.get_subscription_count() > 0
        if wanted and self._input is None:
            self._input = self.create_subscription(Contacts, 'contacts', self._take, _QUEUE)
        elif not wanted and self._input is not None:
            self.destroy_subscription(self._input)
            self._input = None

    def _take(self, message: Contacts) -> None:
        self._markers.note(message)
        now = time.monotonic()
        if now >= self._due_s:
            self._due_s = now + 1 / self._settings['rate']
            self._output.publish(self._markers.frame(message.header, {'contacts': message}))


def main(args: list[str] | None = None) -> None:
    """The process finger_markers_node."""
    sys.exit(run_node(FingerMarkersNode, args))


if __name__ == '__main__':
    main()
