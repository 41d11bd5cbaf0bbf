# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the nodes that draw for RViz share: markers for those who look, and a place in the sensor frame on /tf_static."""
from __future__ import annotations

from collections.abc import Sequence

from geometry_msgs.msg import TransformStamped
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_system_default
from std_msgs.msg import Header
from tactile_driver.errors import BadArgument
from tactile_driver.nodes.diagnostics import SayOnce
from tactile_driver.nodes.parameter_server import NodeParameters
from tactile_driver.nodes.parameters import Parameter
from tactile_perception.nodes.conversions import vector
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray


class DrawingNode(Node):
    """Subclasses set self.markers, which draws (frame) and clears (nothing), and say in follow_demand what they subscribe to.

    table: of the node's parameters. Raises BadArgument for one that cannot be used.
    """

    def __init__(self, name: str, table: Sequence[Parameter]):
        super().__init__(name)
        self.settings = NodeParameters(self, table)
        if self.settings.problems:
            raise BadArgument(f'{name}: ' + '; '.join(self.settings.problems.values()))
        self.say = SayOnce(self)
        self.marker_output = self.demanded(MarkerArray, 'markers')
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._place_output = self.create_publisher(TFMessage, '/tf_static', latched)

    def demanded(self, kind: type, topic: str) -> Publisher:
        """A publisher whose subscribers' coming and going calls follow_demand."""
        matched = PublisherEventCallbacks(matched=lambda _info: self.follow_demand())
        return self.create_publisher(kind, topic, qos_profile_system_default, event_callbacks=matched)

    def follow_demand(self) -> None:
        """Subscribe to what is wanted now, and to nothing else."""
        raise NotImplementedError

    def publish_place(self, name: str, translation: Sequence[float], rotation: Sequence[float] = (0.0, 0.0, 0.0, 1.0)) -> None:
        """Frame <sensor>_<name> at translation, m, and quaternion x, y, z, w in the sensor frame, which so exists for RViz too.

        tf2_ros' broadcaster needs a C++ extension; this does not.
        """
        frame = self.settings['frame_id']
        place = TransformStamped(child_frame_id=f'{frame}_{name}')
        place.header.frame_id, place.header.stamp = frame, self.get_clock().now().to_msg()
        place.transform.translation = vector(translation)
        turned = place.transform.rotation
        turned.x, turned.y, turned.z, turned.w = map(float, rotation)
        self._place_output.publish(TFMessage(transforms=[place]))

    def destroy_node(self) -> None:
        """Take the markers away first."""
        if self.context.ok() and self.marker_output.get_subscription_count():
            self.marker_output.publish(self.markers.nothing(Header(frame_id=self.settings['frame_id'])))
        super().destroy_node()
