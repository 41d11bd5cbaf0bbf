# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""taxel_markers_node: RViz markers and image_annotated of a taxel array, and the frame of its taxels on /tf_static."""
from __future__ import annotations

import sys

from rclpy.qos import QoSProfile, qos_profile_sensor_data
from rclpy.timer import Timer
from sensor_msgs.msg import Image
from tactile_driver.errors import TactileError
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import image_to_message
from tactile_driver.nodes.messages.images import grey_to_array, message_type
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.run import run_node
from tactile_driver.nodes.runtime.ros_defaults import steady_timer
from tactile_perception.nodes.messages.conversions import RESULTS

from .drawing_node import DrawingNode
from ..parameters.table import TAXEL_MARKERS_PARAMETERS
from ..visualization.annotated_image import annotate
from ..visualization.markers.taxel import TaxelMarkers
from ..visualization.markers.taxel_annotation import coloured, taxel_annotation

_INPUTS = {'image_raw': Image, **RESULTS}
_KEPT = 20  # messages per topic, chosen: among these the node looks for equal stamps


class TaxelMarkersNode(DrawingNode):
    """Draws at the rate that parameter rate sets: markers and image_annotated, each while it has subscribers."""

    def __init__(self, host: Host | None = None):
        super().__init__('taxel_markers_node', TAXEL_MARKERS_PARAMETERS, host)
        self.markers = TaxelMarkers(self.settings)
        self._picture_output = self.demanded(Image, 'image_annotated')
        self._inputs: list = []
        self._kept: dict[str, dict] = {}
        self.publish_place('taxels', (0.0, 0.0, -self.settings['cell_height']))
        self._drawing: Timer | None = None
        self.follow_demand()

    def follow_demand(self) -> None:
        """Subscribe to images and results while somebody looks."""
        wanted = self.marker_output.get_subscription_count() > 0 or self._picture_output.get_subscription_count() > 0
        if wanted and not self._inputs:
            self._inputs = [self.create_subscription(
                message_type(kind, self.resolve_topic_name(topic)), topic, lambda message, topic=topic: self._take(topic, message),
                qos_profile_sensor_data if topic == 'image_raw' else QoSProfile(depth=_KEPT)) for topic, kind in _INPUTS.items()]
            self._drawing = steady_timer(self, 1 / self.settings['rate'], self._draw)
        elif not wanted and self._inputs:
            for subscription in self._inputs:
                self.destroy_subscription(subscription)
            self.destroy_timer(self._drawing)
            self._inputs, self._kept, self._drawing = [], {}, None

    def _take(self, topic: str, message) -> None:
        self.try_message(topic, message, lambda: self._keep(topic, message))

    def _keep(self, topic: str, message) -> None:
        kept = self._kept.setdefault(topic, {})
        kept[message.header.stamp.sec, message.header.stamp.nanosec] = message
        while len(kept) > _KEPT:
            del kept[next(iter(kept))]

    def _draw(self) -> None:
        """Draw the newest stamp that has an image and all results."""
        common = set(self._kept.get('image_raw', {})).intersection(*(self._kept.get(topic, {}) for topic in RESULTS))
        if not common:
            return
        newest = max(common)
        found = {topic: kept[newest] for topic, kept in self._kept.items() if newest in kept}
        self._kept, header = {}, found['contact_region'].header
        try:
            if self.marker_output.get_subscription_count():
                self.publish_drawn(self.marker_output, header, lambda: self.markers.frame(header, found))
            if self._picture_output.get_subscription_count():
                self.publish_drawn(self._picture_output, header, lambda: self._picture(found))
        except TactileError as error:
            self.log.refuse(str(error))
            self.say.error('image', f'nothing drawn: {error}')
        except Exception as error:
            self.log.refuse(self.net.catch(error, 'image_raw and results'))

    def _picture(self, found: dict) -> Image:
        """The taxels in colours, with what was found."""
        values = grey_to_array(found['image_raw'], 'taxel image')
        picture = annotate(coloured(values, self.settings['full_value']), taxel_annotation(found, values.shape, self.settings))
        return image_to_message(Frame(picture, 0, 'bgr8'), 'bgr8', found['image_raw'].header)


def main(args: list[str] | None = None) -> None:
    """Run the process taxel_markers_node."""
    sys.exit(run_node(TaxelMarkersNode, args))


if __name__ == '__main__':
    main()
