# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""markers_node: what the sensor sees and feels, for RViz: markers, image_annotated and the camera's place on /tf_static."""
from __future__ import annotations

import sys
import time

import cv2
import numpy as np
from geometry_msgs.msg import Quaternion, TransformStamped
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data, qos_profile_system_default
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header
from tactile_driver.errors import BadArgument, TactileError
from tactile_driver.frame import Frame
from tactile_driver.nodes.conversions import image_to_message
from tactile_driver.nodes.diagnostics import SayOnce
from tactile_driver.nodes.parameter_server import NodeParameters
from tactile_driver.nodes.run import run_node
from tactile_driver.stitching import Stitching, load_stitching
from tactile_msgs.msg import DotTracks
from tactile_perception.nodes.conversions import camera_matrices, image_to_array, vector
from tactile_perception.nodes.touchpad_stages import RESULTS
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from ..parameters import MARKERS_PARAMETERS
from ..picture import annotate
from ..stamp_sync import StampSync
from .annotation import Projection, annotation_of
from .marker_messages import MarkerSet

_INPUTS = {'dots': DotTracks, **RESULTS}
_LOOK_S = 0.2
_PATIENCE_S = 15.0  # for the tracker to subscribe to images: on a busy machine it takes long to start
_QUEUE = QoSProfile(depth=10)


class MarkersNode(Node):
    """Draws while somebody looks: markers for subscribers to markers, pictures for those to image_annotated."""

    def __init__(self):
        super().__init__('markers_node')
        self._settings = NodeParameters(self, MARKERS_PARAMETERS)
        if self._settings.problems:
            raise BadArgument('markers_node: ' + '; '.join(self._settings.problems.values()))
        self._say = SayOnce(self)
        self._markers = MarkerSet(self._settings)
        self._camera: Projection | None = None
        self._stitching = _stitching_in(self._settings['calibration'])
        self._inputs: dict[str, object] = {}
        self._expected: set[str] = set()
        self._asked_s = 0.0
        self._marker_sync = StampSync(self._publish_markers, lambda: self._expected - {'image_raw'})
        self._picture_sync = StampSync(self._publish_picture, lambda: self._expected)
        matched = PublisherEventCallbacks(matched=lambda _info: self._follow_demand())
        self._marker_output = self.create_publisher(MarkerArray, 'markers', qos_profile_system_default, event_callbacks=matched)
        self._picture_output = self.create_publisher(Image, 'image_annotated', qos_profile_system_default, event_callbacks=matched)
        self._publish_camera_place()
        self._look_timer = self.create_timer(_LOOK_S, self._follow_demand)

    def destroy_node(self) -> None:
        """Take the markers away first."""
        if self.context.ok() and self._marker_output.get_subscription_count():
            self._marker_output.publish(self._markers.nothing(Header(frame_id=self._settings['frame_id'])))
        super().destroy_node()

    def _publish_camera_place(self) -> None:
        """Where the camera is, so that the sensor frame exists for RViz too. tf2_ros' broadcaster needs a C++ extension; this does not."""
        rotation, translation = (np.array(self._settings[f'camera.{name}']) for name in ('rotation', 'translation'))
        if rotation.shape != (3,) or translation.shape != (3,):
            raise BadArgument('parameters camera.rotation and camera.translation must have three numbers each')
        place = TransformStamped(child_frame_id=self._settings['frame_id'] + '_camera')
        place.header.frame_id, place.header.stamp = self._settings['frame_id'], self.get_clock().now().to_msg()
        place.transform.translation = vector(-cv2.Rodrigues(rotation)[0].T @ translation)
        angle = float(np.linalg.norm(rotation))
        axis = -rotation * (np.sin(angle / 2) / angle) if angle else np.zeros(3)
        place.transform.rotation = Quaternion(x=axis[0], y=axis[1], z=axis[2], w=float(np.cos(angle / 2)))
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._place_output = self.create_publisher(TFMessage, '/tf_static', latched)
        self._place_output.publish(TFMessage(transforms=[place]))

    def _follow_demand(self) -> None:
        """Subscribe to what is wanted now, and see which of it exists."""
        pictures = self._picture_output.get_subscription_count() > 0
        wanted = set(_INPUTS) if pictures or self._marker_output.get_subscription_count() else set()
        for topic in wanted - self._inputs.keys():
            self._subscribe(topic, _INPUTS[topic], _QUEUE)
        if wanted and not self._asked_s:
            self._asked_s = time.monotonic()
        self._expected = {topic for topic in wanted if self.count_publishers(topic)} | ({'image_raw'} if pictures else set())
        # After the tracker: a recording begins with its first subscriber, and a picture without dots is of little use.
        if pictures and (self.count_subscribers('image_raw') or time.monotonic() - self._asked_s > _PATIENCE_S):
            wanted |= {'image_raw', 'camera_info'}
            if 'image_raw' not in self._inputs:
                self._inputs['camera_info'] = self.create_subscription(CameraInfo, 'camera_info', self._on_camera_info,
                                                                       qos_profile_sensor_data)
                self._subscribe('image_raw', Image, qos_profile_sensor_data)
        for topic in self._inputs.keys() - wanted:
            self.destroy_subscription(self._inputs.pop(topic))
        if not wanted:
            self._asked_s = 0.0

    def _subscribe(self, topic: str, kind: type, qos: QoSProfile) -> None:
        self._inputs[topic] = self.create_subscription(kind, topic, lambda message: self._on_message(topic, message), qos)

    def _on_message(self, topic: str, message) -> None:
        stamp_ns = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
        if topic != 'image_raw' and self._marker_output.get_subscription_count():
            self._marker_sync.add(topic, stamp_ns, message)
        if self._picture_output.get_subscription_count():
            self._picture_sync.add(topic, stamp_ns, message)

    def _on_camera_info(self, message: CameraInfo) -> None:
        if self._camera is None or self._camera.key != Projection.key_of(message):
            try:
                self._camera = Projection(message, camera_matrices(message), self._settings['camera.rotation'],
                                          self._settings['camera.translation'], self._stitching)
            except TactileError as error:
                self._say.error('camera_info', str(error))

    def _publish_markers(self, found: dict) -> None:
        header = next(iter(found.values())).header
        self._marker_output.publish(self._markers.frame(header, found))

    def _publish_picture(self, found: dict) -> None:
        message = found.get('image_raw')
        if message is None:
            return
        try:
            picture = annotate(image_to_array(message), annotation_of(found, self._camera))
        except TactileError as error:
            self._say.error('image', f'no picture: {error}')
            return
        self._say.forget('image')
        self._picture_output.publish(image_to_message(Frame(picture, 0, 'bgr8'), 'bgr8', message.header))


def _stitching_in(calibration: str) -> Stitching | None:
    """That of a calibration file; None where there is none: what is wrong with a file, the node says that estimates by it."""
    try:
        return load_stitching(calibration) if calibration else None
    except BadArgument:
        return None


def main(args: list[str] | None = None) -> None:
    """The process markers_node."""
    sys.exit(run_node(MarkersNode, args))


if __name__ == '__main__':
    main()
