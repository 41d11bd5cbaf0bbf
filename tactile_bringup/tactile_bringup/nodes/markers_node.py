# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""markers_node: RViz markers and image_annotated of an optical sensor."""
from __future__ import annotations

import sys
import time

import numpy as np
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import CameraInfo, Image
from tactile_driver.errors import BadArgument
from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.nodes.runtime.host import AdaptiveSubscription, Host
from tactile_driver.nodes.runtime.run import run_node
from tactile_driver.nodes.runtime.ros_defaults import steady_timer
from tactile_driver.stitching.calibration import Stitching, load_stitching
from tactile_msgs.msg import DotTracks
from tactile_perception.nodes.messages.conversions import RESULTS, camera_matrices

from .drawing_node import DrawingNode, StampSync
from ..parameters.table import MARKERS_PARAMETERS
from ..visualization.pictures import annotate
from ..visualization.annotation import Projection, annotation_of
from ..visualization.markers import MarkerSet

_INPUTS = {'dots': DotTracks, **RESULTS}
_LOOK_S = 0.2  # chosen: interval between two checks for publishers and subscribers
_PATIENCE_S = 15.0  # chosen: longest wait for the tracker to subscribe to images, which takes long on a busy machine
_QUEUE = QoSProfile(depth=10)
_INFO_QUEUE = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class MarkersNode(DrawingNode):
    """Draws every stamp whose messages are complete; pictures at most at the rate that parameter picture_rate sets."""

    def __init__(self, host: Host | None = None):
        super().__init__('markers_node', MARKERS_PARAMETERS, host)
        if any(len(self.settings[f'camera.{name}']) != 3 for name in ('rotation', 'translation')):
            raise BadArgument('parameters camera.rotation and camera.translation must have three numbers each')
        self.markers = MarkerSet(self.settings)
        self._camera: Projection | None = None
        self._stitching = _stitching_in(self.settings['calibration'])
        self._inputs: dict[str, AdaptiveSubscription] = {}
        self._expected: set[str] = set()
        self._asked_s = 0.0
        rate = self.settings['picture_rate']
        self._picture_period_ns = round(1e9 / rate) if rate else 0
        self._picture_ns = 0  # stamp of the last picture
        self._marker_sync = StampSync(self._publish_markers, lambda: self._expected - {'image_raw'})
        self._picture_sync = StampSync(self._publish_picture, lambda: self._expected)
        self._look_timer = steady_timer(self, _LOOK_S, self.follow_demand)  # while there is demand: each call wakes the executor

    def follow_demand(self) -> None:
        """Subscribe to the inputs that are needed now, and update which of them have publishers."""
        pictures = self.picture_output.get_subscription_count() > 0
        wanted = set(_INPUTS) if self.watched else set()
        for topic in wanted - self._inputs.keys():
            self._subscribe(topic, _INPUTS[topic], _QUEUE)
        if wanted and not self._asked_s:
            self._asked_s = time.monotonic()
        self._expected = {topic for topic in wanted if self.count_publishers(topic)} | ({'image_raw'} if pictures else set())
        # Subscribe to images after the tracker: a played recording starts with its first subscriber, and its first frames need dots.
        tracked = self.count_subscribers('image_raw') or self.host.has_takers(self, 'image_raw')
        if pictures and (tracked or time.monotonic() - self._asked_s > _PATIENCE_S):
            wanted |= {'image_raw', 'camera_info'}
            if 'image_raw' not in self._inputs:
                self._inputs['camera_info'] = AdaptiveSubscription(self, CameraInfo, 'camera_info', self._on_camera_info, _INFO_QUEUE)
                self._subscribe('image_raw', Image, _QUEUE)
        for topic in self._inputs.keys() - wanted:
            self._inputs.pop(topic).close()
        if not wanted:
            self._asked_s = 0.0
            self._look_timer.cancel()
        elif self._look_timer.is_canceled():
            self._look_timer.reset()

    def _subscribe(self, topic: str, kind: type, qos: QoSProfile) -> None:
        self._inputs[topic] = AdaptiveSubscription(self, kind, topic, lambda message, _ns: self._on_message(topic, message), qos)

    def _on_message(self, topic: str, message) -> None:
        self.try_message(topic, message, lambda: self._take(topic, message, stamp_ns_of(message.header)))

    def _take(self, topic: str, message, stamp_ns: int) -> None:
        if topic != 'image_raw' and self.marker_output.get_subscription_count():
            self._marker_sync.add(topic, stamp_ns, message)
        if self.picture_output.get_subscription_count():
            self._picture_sync.add(topic, stamp_ns, message)

    def _on_camera_info(self, message: CameraInfo, _received_ns: int) -> None:
        self.try_message('camera_info', message, lambda: self._take_camera(message))

    def _take_camera(self, message: CameraInfo) -> None:
        if self._camera is None or self._camera.key != Projection.key_of(message):
            self._camera = Projection(message, camera_matrices(message), self.settings['camera.rotation'],
                                      self.settings['camera.translation'], self._stitching)

    def _publish_markers(self, found: dict) -> None:
        self.draw_markers(next(iter(found.values())).header, found)

    def _is_due(self, stamp_ns: int) -> bool:
        """Whether a picture of this stamp is drawn; a stamp may be early by the jitter of half a frame at twice the rate."""
        if 0 <= stamp_ns - self._picture_ns < 0.75 * self._picture_period_ns:
            return False
        self._picture_ns = stamp_ns
        return True

    def _publish_picture(self, found: dict) -> None:
        message = found.get('image_raw')
        if message is not None and self._is_due(stamp_ns_of(message.header)):
            self.draw_picture(message.header, found)

    def picture(self, found: dict) -> np.ndarray:
        """See DrawingNode."""
        return annotate(image_to_array(found['image_raw']), annotation_of(found, self._camera))


def _stitching_in(calibration: str) -> Stitching | None:
    """Stitching of a calibration file; None without one or for a bad file, which the estimating node reports."""
    try:
        return load_stitching(calibration) if calibration else None
    except BadArgument:
        return None


def main(args: list[str] | None = None) -> None:
    """Run the process markers_node."""
    sys.exit(run_node(MarkersNode, args))


if __name__ == '__main__':
    main()
