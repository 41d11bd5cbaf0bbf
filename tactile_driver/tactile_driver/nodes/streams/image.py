# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stream of one camera's images."""
from __future__ import annotations

from rclpy.lifecycle import LifecycleNode
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

from .base import ACKNOWLEDGE, BaseStream, RawPublishers
from ...frame import CameraCalibration, Frame
from ..messages.conversions import calibration_to_message, header_of, image_to_message
from ..runtime.ros_defaults import LATCHED_QOS, STREAM_QOS
from ...sources.base.protocol import Source


class ImageTopic:
    """image_raw and camera_info of one view, under prefix ('' or 'left/')."""

    def __init__(self, node: LifecycleNode, prefix: str = ''):
        self.image = node.create_lifecycle_publisher(Image, prefix + 'image_raw', STREAM_QOS)
        self.info = node.create_lifecycle_publisher(CameraInfo, prefix + 'camera_info', LATCHED_QOS)

    @property
    def wanted(self) -> bool:
        """Whether anybody subscribes."""
        return bool(self.image.get_subscription_count() or self.info.get_subscription_count())

    def publish(self, frame: Frame, encoding: str, header: Header, info: CameraInfo) -> None:
        """Publish info and the frame under the header; the image, which needs info, is made only if somebody subscribes to it."""
        info.header = header
        self.info.publish(info)
        if self.image.get_subscription_count():
            self.image.publish(image_to_message(frame, encoding, header))

    def wait_until_received(self) -> None:
        """Reliable subscribers say when they have the image: wait for them."""
        self.image.wait_for_all_acked(ACKNOWLEDGE)


class ImagePublishers(RawPublishers):
    """Besides what all drivers publish: image_raw and camera_info."""

    def __init__(self, node: LifecycleNode):
        super().__init__(node)
        self.picture = ImageTopic(node)

    @property
    def wanted(self) -> bool:
        """Whether anybody subscribes to frames or what comes with them."""
        return self.picture.wanted or super().wanted


class ImageStream(BaseStream):
    """Publishes the frames of one camera.

    encoding: of image_raw, '' for the frames' own; calibration: for camera_info, None where it is not known.
    """

    def __init__(self, node: LifecycleNode, publishers: ImagePublishers, source: Source, values: dict,
                 calibration: CameraCalibration | None):
        self._calibration, self._info, self._size = calibration, None, None
        super().__init__(node, publishers, source, values)

    def _publish(self, frame: Frame) -> None:
        header = header_of(frame.stamp_ns, self._values['frame_id'])
        size = frame.image.shape[1], frame.image.shape[0]
        if size != self._size:
            self._new_size(size, frame.encoding)
        self._publishers.picture.publish(frame, self._values['encoding'], header, self._info)
        if frame.truth is not None:
            self._publishers.truth.publish(frame.truth, 1 / self.source.describe()['rate'], header)
        if self.source.on_demand:
            self._publishers.picture.wait_until_received()

    def _new_size(self, size: tuple[int, int], encoding: str) -> None:
        """Make camera_info for images of this size, px, and complete the description."""
        self._remarks = []
        self._remark(size_remark(self._values, size))
        self._info, remark = info_of_size(self._calibration, size)
        self._remark(remark)
        self._size = size
        self._describe(width=size[0], height=size[1], encoding=self._values['encoding'] or encoding)


def size_remark(values: dict, size: tuple[int, int]) -> str:
    """What to say where a device gives images of another size, px, than it was asked for; else ''."""
    asked = values['width'] or size[0], values['height'] or size[1]
    if values['source'] != 'device' or asked == size:
        return ''
    return (f'the camera gives {size[0]} x {size[1]} px instead of {asked[0]} x {asked[1]} px; set width, height and '
            'pixel_format to what it offers (v4l2-ctl --list-formats-ext)')


def info_of_size(known: CameraCalibration | None, size: tuple[int, int]) -> tuple[CameraInfo, str]:
    """camera_info for images of this size, px, and what to say where the calibration is for another one."""
    if known is None or (known.width, known.height) == size:
        return calibration_to_message(known or CameraCalibration(*size)), ''
    return calibration_to_message(CameraCalibration(*size)), (
        f'the camera calibration is for {known.width} x {known.height} px, but images are {size[0]} x {size[1]} px: '
        'camera_info is published as uncalibrated; set camera_info_path to a calibration of this size')
