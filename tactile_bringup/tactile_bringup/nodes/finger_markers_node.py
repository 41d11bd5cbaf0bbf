# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""finger_markers_node: RViz markers and image_annotated of a PSD finger, and the frame at its tip on /tf_static."""
from __future__ import annotations

import sys
import time

from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import image_to_message
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.run import run_node
from tactile_msgs.msg import Contacts

from .drawing_node import DrawingNode
from ..parameters.table import FINGER_MARKERS_PARAMETERS
from ..visualization.markers.finger import FingerMarkers, finger_picture

# Queue of contacts: depth chosen.
_QUEUE = QoSProfile(depth=200)


class FingerMarkersNode(DrawingNode):
    """Draws at the rate that parameter rate sets: markers and image_annotated, each while it has subscribers."""

    def __init__(self, host: Host | None = None):
        super().__init__('finger_markers_node', FINGER_MARKERS_PARAMETERS, host)
        self.markers = FingerMarkers(self.settings)
        self._picture_output = self.demanded(Image, 'image_annotated')
        self._input, self._due_s = None, 0.0
        self.publish_place('tip', (0.0, 0.0, self.settings['radius']))
        self.follow_demand()

    def follow_demand(self) -> None:
        """Subscribe to contacts while somebody looks."""
        wanted = self.marker_output.get_subscription_count() > 0 or self._picture_output.get_subscription_count() > 0
        if wanted and self._input is None:
            self._input = self.create_subscription(Contacts, 'contacts', self._take, _QUEUE)
        elif not wanted and self._input is not None:
            self.destroy_subscription(self._input)
            self._input = None

    def _take(self, message: Contacts) -> None:
        self.try_message('contacts', message, lambda: self._draw(message))

    def _draw(self, message: Contacts) -> None:
        self.markers.note(message)
        now = time.monotonic()
        if now < self._due_s:
            return
        self._due_s = now + 1 / self.settings['rate']
        if self.marker_output.get_subscription_count():
            self.publish_drawn(self.marker_output, message.header, lambda: self.markers.frame(message.header, {'contacts': message}))
        if self._picture_output.get_subscription_count():
            self.publish_drawn(self._picture_output, message.header, lambda: picture_of(message))


def picture_of(message: Contacts) -> Image:
    """The hemisphere from above with its contacts."""
    return image_to_message(Frame(finger_picture(message), 0, 'bgr8'), 'bgr8', message.header)


def main(args: list[str] | None = None) -> None:
    """Run the process finger_markers_node."""
    sys.exit(run_node(FingerMarkersNode, args))


if __name__ == '__main__':
    main()
