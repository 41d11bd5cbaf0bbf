# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""taxel_markers_node: what a taxel array sees and feels, for RViz: markers, and the array's own frame on /tf_static."""
from __future__ import annotations

import sys

from geometry_msgs.msg import TransformStamped
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data, qos_profile_system_default
from sensor_msgs.msg import Image
from std_msgs.msg import Header
from tactile_driver.errors import BadArgument, TactileError
from tactile_driver.nodes.diagnostics import SayOnce
from tactile_driver.nodes.parameter_server import NodeParameters
from tactile_driver.nodes.run import run_node
from tactile_perception.nodes.taxel_stages import RESULTS
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from ..parameters import TAXEL_MARKERS_PARAMETERS
from .taxel_markers import TaxelMarkers

_INPUTS = {'image_raw': Image, **RESULTS}
_KEPT = 20  # messages of each topic, among which those of one instant are sought


class TaxelMarkersNode(Node):
    """Draws, while somebody looks, as often as an eye can follow."""

    def __init__(self):
        super().__init__('taxel_markers_node')
        self._settings = NodeParameters(self, TAXEL_MARKERS_PARAMETERS)
        if self._settings.problems:
            raise BadArgument('taxel_markers_node: ' + '; '.join(self._settings.problems.values()))
        self._markers, self._say = TaxelMarkers(self._settings), SayOnce(self)
        self._inputs: list = []
        self._kept: dict[str, dict] = {}
        matched = PublisherEventCallbacks(matched=lambda _info: self._follow_demand())
        self._output = self.create_publisher(MarkerArray, 'markers', qos_profile_system_default, event_callbacks=matched)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._place_output = self.create_publisher(TFMessage, '/tf_static', latched)
        self._publish_array()
        self.create_timer(1 / self._settings['rate'], self._draw)
        self._follow_demand()

    def destroy_node(self) -> None:
        """Take the markers away first."""
        if self.context.ok() and self._output.get_subscription_count():
            self._output.publish(self._markers.nothing(Header(frame_id=self._settings['frame_id'])))
        super().destroy_node()

    def _publish_array(self) -> None:
        """The frame of the taxels under the pad, so that the sensor frame exists for RViz too."""
        frame = self._settings['frame_id']
        array = TransformStamped(child_frame_id=frame + '_taxels')
        array.header.frame_id, array.header.stamp = frame, self.get_clock().now().to_msg()
        array.transform.translation.z = -self._settings['cell_height']
        array.transform.rotation.w = 1.0
        self._place_output.publish(TFMessage(transforms=[array]))

    def _follow_demand(self) -> None:
        wanted = self._output.get_subscription_count() > 0
        if wanted and not self._inputs:
            self._inputs = [self.create_subscription(kind, topic, lambda message, topic=topic: self._take(topic, message),
                                                     qos_profile_sensor_data if topic == 'image_raw' else QoSProfile(depth=_KEPT))
                            for topic, kind in _INPUTS.items()]
        elif not wanted and self._inputs:
            for subscription in self._inputs:
                self.destroy_subscription(subscription)
            self._inputs, self._kept = [], {}

    def _take(self, topic: str, message) -> None:
        kept = self._kept.setdefault(topic, {})
        kept[message.header.stamp.sec, message.header.stamp.nanosec] = message
        while len(kept) > _KEPT:
            del kept[next(iter(kept))]

    def _draw(self) -> None:
        """The newest instant of which there are an image and results."""
        common = set(self._kept.get('image_raw', {})).intersection(*(self._kept.get(topic, {}) for topic in RESULTS))
        if not common:
            return
        newest = max(common)
        found = {topic: kept[newest] for topic, kept in self._kept.items() if newest in kept}
        self._kept = {}
        try:
            self._output.publish(self._markers.frame(found['image_raw'].header, found))
        except TactileError as error:
            self._say.error('image', f'no markers: {error}')


def main(args: list[str] | None = None) -> None:
    """The process taxel_markers_node."""
    sys.exit(run_node(TaxelMarkersNode, args))


if __name__ == '__main__':
    main()
