# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The streams of images of an open source: read in one thread, published in another."""
from __future__ import annotations

import threading

import yaml
from rclpy._rclpy_pybind11 import RCLError
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_system_default
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header, String

from ..frame import CameraCalibration, Frame
from ..sources.capture import Capture, CaptureStatus
from ..sources.dual import DualSource
from ..sources.protocol import Source
from .camera_health import capture_health
from .conversions import calibration_to_message, header_of, image_to_message
from .diagnostics import Health, SayOnce
from .ground_truth import GroundTruth

_TAKE_S = 0.2
_ACKNOWLEDGE = Duration(seconds=1)


class ImageTopic:
    """image_raw and camera_info of one view, under prefix ('' or 'left/')."""

    def __init__(self, node: LifecycleNode, prefix: str = ''):
        self.image = node.create_lifecycle_publisher(Image, prefix + 'image_raw', qos_profile_system_default)
        self.info = node.create_lifecycle_publisher(CameraInfo, prefix + 'camera_info', qos_profile_system_default)

    @property
    def wanted(self) -> bool:
        """Whether anybody subscribes."""
        return bool(self.image.get_subscription_count() or self.info.get_subscription_count())

    def publish(self, frame: Frame, encoding: str, header: Header, info: CameraInfo) -> None:
        """Publish the frame and info under the header; the image is made only if somebody subscribes to it."""
        if self.image.get_subscription_count():
            self.image.publish(image_to_message(frame, encoding, header))
        info.header = header
        self.info.publish(info)

    def wait_until_received(self) -> None:
        """Reliable subscribers say when they have the image: wait for them."""
        self.image.wait_for_all_acked(_ACKNOWLEDGE)


class ImagePublishers:
    """image_raw, camera_info, description (latched) and ground_truth/* of a node; they last as long as the node does."""

    def __init__(self, node: LifecycleNode):
        self.picture = ImageTopic(node)
        self.description = node.create_publisher(String, 'description', QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        self.truth = GroundTruth(node)

    @property
    def wanted(self) -> bool:
        """Whether anybody subscribes to frames or what comes with them."""
        return self.picture.wanted or self.truth.wanted


class BaseStream:
    """Publishes what comes from source, which is open and is closed by stop: read in one thread, published in another.

    values: the node's parameters, of which sensor_type and frame_id go into the description. keep: how many frames of a live source wait to
    be published, the newest ones.
    """

    keep = 1

    def __init__(self, node: LifecycleNode, publishers: ImagePublishers, source: Source | DualSource, values: dict):
        self._node, self._publishers, self.source, self._values = node, publishers, source, values
        self._say = SayOnce(node)
        self._remarks: list[str] = []
        self._active = self._stopped = False
        self._describe()
        self._capture = Capture(source, self._wanted, self._report, keep=self.keep)
        self._thread = threading.Thread(target=self._run, name='publish', daemon=True)
        self._thread.start()

    @property
    def remark(self) -> str:
        """What is wrong with frames that come all the same, ''."""
        return '; '.join(self._remarks)

    def change(self, changes: dict) -> None:
        """Apply parameters that may change while it runs."""
        if 'exposure' in changes and hasattr(self.source, 'set_exposure'):
            self.source.set_exposure(changes['exposure'])

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

    def health(self) -> Health:
        """For /diagnostics."""
        return capture_health(self.status, self.source.describe(), self.source.live, self.remark)

    def _wanted(self) -> bool:
        try:
            return self._publishers.wanted
        except RCLError:  # ROS ends before this thread does
            if self._node.context.ok():
                raise
            return False

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

    def _publish(self, frame) -> None:
        raise NotImplementedError

    def _remark(self, text: str) -> None:
        if text and text not in self._remarks:
            self._remarks.append(text)
            self._say.warning(text, text)

    def _describe(self, **known) -> None:
        about = {'sensor_type': self._values['sensor_type'], 'frame_id': self._values['frame_id'], **self.source.describe(), **known}
        self._publishers.description.publish(String(data=yaml.safe_dump(about, sort_keys=False)))


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
