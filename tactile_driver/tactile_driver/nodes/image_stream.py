# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stream of images of one open source: read in one thread, published in another."""
from __future__ import annotations

import threading

import yaml
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_system_default
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String

from ..frame import CameraCalibration, Frame
from ..sources.capture import Capture, CaptureStatus
from ..sources.protocol import Source
from .conversions import calibration_to_message, header_of, image_to_message
from .diagnostics import SayOnce
from .ground_truth import GroundTruth

_TAKE_S = 0.2
_ACKNOWLEDGE = Duration(seconds=1)


class ImagePublishers:
    """image_raw, camera_info, description (latched) and ground_truth/* of a node; they last as long as the node does."""

    def __init__(self, node: LifecycleNode):
        self.image = node.create_lifecycle_publisher(Image, 'image_raw', qos_profile_system_default)
        self.info = node.create_lifecycle_publisher(CameraInfo, 'camera_info', qos_profile_system_default)
        self.description = node.create_publisher(String, 'description', QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        self.truth = GroundTruth(node)

    @property
    def wanted(self) -> bool:
        """Whether anybody subscribes to frames or what comes with them."""
        return bool(self.image.get_subscription_count() or self.info.get_subscription_count() or self.truth.wanted)


class ImageStream:
    """Publishes the frames of source, which is open and is closed by stop.

    encoding: of image_raw, '' for the frames' own; frame_id: in every header; sensor_type: in the description; calibration: for
    camera_info,
    None where it is not known.
    """

    def __init__(self, node: LifecycleNode, publishers: ImagePublishers, source: Source, values: dict,
                 calibration: CameraCalibration | None):
        self._node, self._publishers, self.source = node, publishers, source
        self._values, self._calibration = values, calibration
        self._say = SayOnce(node)
        self._info, self._size = None, None
        self.remark = ''
        self._active = self._stopped = False
        self._describe()
        self._capture = Capture(source, lambda: publishers.wanted, self._report)
        self._thread = threading.Thread(target=self._run, name='publish', daemon=True)
        self._thread.start()

    def resume(self) -> None:
        """Publish from now on."""
        self._active = True
        self._capture.resume()

    def pause(self) -> None:
        """Publish nothing until resume."""
        self._active = False
        self._capture.pause()

    def stop(self) -> None:
        """End the threads and close the source."""
        self._active, self._stopped = False, True
        self._capture.stop()
        self._thread.join(timeout=5.0)

    @property
    def status(self) -> CaptureStatus:
        """How the capture goes."""
        return self._capture.status

    def _report(self, level: str, text: str) -> None:
        if level == 'error':
            self._node.get_logger().error(text)
        else:
            self._node.get_logger().info(text)
            self._describe()

    def _run(self) -> None:
        while not self._stopped:
            frame = self._capture.take(_TAKE_S)
            if frame is None or not self._active:
                continue
            try:
                self._publish(frame)
            except Exception as error:  # the thread must outlive a frame that cannot be published
                if not self._node.context.ok():
                    return
                self._say.error('publish', f'a frame could not be published: {error!r}; the next one is tried')

    def _publish(self, frame: Frame) -> None:
        header = header_of(frame.stamp_ns, self._values['frame_id'])
        size = frame.image.shape[1], frame.image.shape[0]
        if size != self._size:
            self._new_size(size, frame.encoding)
        self._info.header = header
        if self._publishers.image.get_subscription_count():
            self._publishers.image.publish(image_to_message(frame, self._values['encoding'], header))
        self._publishers.info.publish(self._info)
        if frame.truth is not None:
            self._publishers.truth.publish(frame.truth, 1 / self.source.describe()['rate'], header)
        if self.source.on_demand:
            # As fast as it is consumed: reliable subscribers say when they have it.
            self._publishers.image.wait_for_all_acked(_ACKNOWLEDGE)

    def _new_size(self, size: tuple[int, int], encoding: str) -> None:
        """Make camera_info for images of this size, px, and complete the description."""
        known, self.remark = self._calibration, ''
        asked = self._values['width'] or size[0], self._values['height'] or size[1]
        if self._values['source'] == 'device' and asked != size:
            self._remark(f'the camera gives {size[0]} x {size[1]} px instead of {asked[0]} x {asked[1]} px; set width, height and '
                         'pixel_format to what it offers (v4l2-ctl --list-formats-ext)')
        if known is not None and (known.width, known.height) != size:
            self._remark(f'the camera calibration is for {known.width} x {known.height} px, but images are {size[0]} x {size[1]} px: '
                         'camera_info is published as uncalibrated; set camera_info_path to a calibration of this size')
            known = None
        self._info = calibration_to_message(known or CameraCalibration(*size))
        self._size = size
        self._describe(width=size[0], height=size[1], encoding=self._values['encoding'] or encoding)

    def _remark(self, text: str) -> None:
        self.remark = f'{self.remark}; {text}' if self.remark else text
        self._say.warning(text, text)

    def _describe(self, **known) -> None:
        about = {'sensor_type': self._values['sensor_type'], 'frame_id': self._values['frame_id'], **self.source.describe(), **known}
        self._publishers.description.publish(String(data=yaml.safe_dump(about, sort_keys=False)))
