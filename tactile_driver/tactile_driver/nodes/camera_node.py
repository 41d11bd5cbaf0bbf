# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""camera_node: publishes image_raw and camera_info from a camera, a recording or a simulated sensor; a lifecycle node."""
from __future__ import annotations

import sys
from collections.abc import Mapping
from functools import partial

from rclpy.lifecycle import LifecycleNode
from sensor_msgs.msg import CameraInfo, Image
from sensor_msgs.srv import SetCameraInfo
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from ..errors import BadArgument, TactileError
from ..frame import CameraCalibration, Frame, load_calibration, save_calibration
from ..frame_names import optical_frame
from ..parameters.drivers import CAMERA_PARAMETERS, known_pose
from ..sources.registry import CAMERA_SOURCES, make_source
from ..sources.source import Source
from .driver_node import ACKNOWLEDGE, BaseStream, DriverNode, RawPublishers
from .messages.conversions import (
    Pose, calibration_of_message, calibration_to_message, camera_transforms, header_of, image_to_message)
from .runtime.host import Host
from .runtime.ros_defaults import LATCHED_QOS, STREAM_QOS
from .runtime.run import run_node
from .topic_source import topic_source


class ImageTopic:
    """image_raw and camera_info of one view, under prefix ('' or 'left/')."""

    def __init__(self, node: LifecycleNode, prefix: str = ''):
        self.image = node.create_lifecycle_publisher(Image, prefix + 'image_raw', STREAM_QOS)
        self.info = node.create_lifecycle_publisher(CameraInfo, prefix + 'camera_info', LATCHED_QOS)

    @property
    def wanted(self) -> bool:
        """Whether image or camera_info has a subscriber."""
        return bool(self.image.get_subscription_count() or self.info.get_subscription_count())

    def publish(self, frame: Frame, encoding: str, header: Header, info: CameraInfo) -> None:
        """Publish info, and the frame if it has subscribers, under the header."""
        info.header = header
        self.info.publish(info)
        if self.image.get_subscription_count():
            self.image.publish(image_to_message(frame, encoding, header))

    def wait_until_received(self) -> None:
        """Wait until all reliable subscribers have acknowledged the image."""
        self.image.wait_for_all_acked(ACKNOWLEDGE)


class ImagePublishers(RawPublishers):
    """image_raw and camera_info, the cameras' frames on /tf_static, and the topics of all drivers."""

    def __init__(self, node: LifecycleNode):
        super().__init__(node)
        self._node = node
        self.picture = ImageTopic(node)
        self._transforms = node.create_publisher(TFMessage, '/tf_static', LATCHED_QOS)  # tf2_ros's broadcaster needs a C++ extension

    def place_cameras(self, frame_id: str, poses: Mapping[str, Pose]) -> None:
        """Publish where the cameras are in the sensor frame frame_id; poses: as of camera_transforms, those that are known."""
        if poses:
            stamp = self._node.get_clock().now().to_msg()
            self._transforms.publish(TFMessage(transforms=camera_transforms(frame_id, poses, stamp)))

    @property
    def wanted(self) -> bool:
        """Whether any of the topics has a subscriber."""
        return self.picture.wanted or super().wanted


class ImageStream(BaseStream):
    """Publishes the frames of one camera.

    values: the node's parameters; calibration: for camera_info, None for the source's own.
    """

    def __init__(self, node: LifecycleNode, publishers: ImagePublishers, source: Source, values: dict,
                 calibration: CameraCalibration | None):
        self._given, self._calibration, self._info, self._size = calibration, None, None, None
        super().__init__(node, publishers, source, values)

    def _publish(self, frame: Frame) -> None:
        header = header_of(frame.stamp_ns, optical_frame(self._values['frame_id']))
        size = frame.image.shape[1], frame.image.shape[0]
        calibration = self._given or self.source.calibration()
        if size != self._size or calibration is not self._calibration:
            self._calibration = calibration
            self._new_size(size, frame.encoding)
        self._publishers.picture.publish(frame, self._values['encoding'], header, self._info)
        self._publish_truth(frame.truth, frame.stamp_ns)
        if self.source.on_demand:
            self._publishers.picture.wait_until_received()

    def calibrate(self, _prefix: str, calibration: CameraCalibration) -> None:
        """Publish this calibration from the next image on."""
        self._given = calibration

    def _new_size(self, size: tuple[int, int], encoding: str) -> None:
        """Make camera_info for images of this size (width, height), px, and complete the description."""
        self._warnings = []
        self._warn(size_warning(self._values, size))
        self._info, warning = info_of_size(self._calibration, size)
        self._warn(warning)
        self._size = size
        self._describe(width=size[0], height=size[1], encoding=self._values['encoding'] or encoding)


def size_warning(values: dict, size: tuple[int, int]) -> str:
    """The warning if a device gives images of another size (width, height), px, than requested; else ''."""
    asked = values['width'] or size[0], values['height'] or size[1]
    if values['source'] != 'device' or asked == size:
        return ''
    return (f'the camera gives {size[0]} x {size[1]} px instead of {asked[0]} x {asked[1]} px; set width, height and '
            'pixel_format to what it offers (v4l2-ctl --list-formats-ext)')


def info_of_size(known: CameraCalibration | None, size: tuple[int, int]) -> tuple[CameraInfo, str]:
    """camera_info for images of this size (width, height), px, and a warning if the calibration is for another size."""
    if known is None or (known.width, known.height) == size:
        return calibration_to_message(known or CameraCalibration(*size)), ''
    return calibration_to_message(CameraCalibration(*size)), (
        f'the camera calibration is for {known.width} x {known.height} px, but images are {size[0]} x {size[1]} px: '
        'camera_info is published as uncalibrated; set camera_info_url to a calibration of this size')


class CalibratedNode(DriverNode):
    """A driver of cameras whose lenses are calibrated: it serves set_camera_info, which camera_calibration calls."""

    def serve_calibration(self, parameter: str, prefix: str = '') -> None:
        """Serve <prefix>set_camera_info: write the file that the parameter names, and publish what it holds from the next image on."""
        def write(request: SetCameraInfo.Request, response: SetCameraInfo.Response) -> SetCameraInfo.Response:
            """Answer with the reason where it cannot be done."""
            url, calibration = self._settings[parameter], calibration_of_message(request.camera_info)
            try:
                if not url or calibration is None:
                    raise BadArgument(f'{parameter} is empty: start the node with the file to write' if not url else
                                      'the camera_info is not calibrated: its width, height and focal lengths must be above 0')
                save_calibration(url, calibration)
            except TactileError as error:
                response.success, response.status_message = False, str(error)
                return response
            if self._stream is not None:
                self._stream.calibrate(prefix, calibration)
            response.success, response.status_message = True, f'written: {url}'
            return response
        self.create_service(SetCameraInfo, prefix + 'set_camera_info', write)


class CameraNode(CalibratedNode):
    """One camera."""

    def __init__(self, host: Host | None = None):
        super().__init__('camera_node', CAMERA_PARAMETERS, 'camera', host)
        self._outputs = ImagePublishers(self)
        self.serve_calibration('camera_info_url')

    def open_stream(self, values: dict) -> ImageStream:
        """See DriverNode."""
        given = load_calibration(values['camera_info_url'])
        poses = known_pose(values)
        sources = {**CAMERA_SOURCES, 'topics': lambda values, _clock: topic_source(self, values['topic'])}
        source = self.opened(partial(make_source, sources), values)
        self._outputs.place_cameras(values['frame_id'], poses)
        return ImageStream(self, self._outputs, source, values, given)


def main(args: list[str] | None = None) -> None:
    """Entry point of camera_node."""
    sys.exit(run_node(CameraNode, args))


if __name__ == '__main__':
    main()
