# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""camera_node: publishes image_raw and camera_info from a camera, a recording or a simulated sensor; a lifecycle node."""
from __future__ import annotations

from collections.abc import Mapping, Sequence

from sensor_msgs.msg import CameraInfo, Image
from sensor_msgs.srv import SetCameraInfo
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from ..errors import BadArgument, TactileError
from ..frame import CameraCalibration, Frame, calibration_of_info, load_calibration, save_calibration
from ..frame_names import optical_frame
from ..parameters.drivers import CAMERA_PARAMETERS, known_pose
from ..parameters.table import Parameter
from ..sources.registry import CAMERA_SOURCES
from ..sources.source import Source
from .driver_node import DriverNode, Stream
from .messages.conversions import Pose, calibration_to_message, camera_transforms, header_of, image_to_message
from .runtime.host import Host
from .runtime.ros_defaults import LATCHED_QOS, STREAM_QOS
from .runtime.run import process_of
from .topic_source import TopicSource


class View:
    """image_raw and camera_info of one camera or of a stitched picture, under prefix ('' or 'left/').

    given: the calibration for camera_info, None for an unknown one; size: (width, height) px of the last image, None before the first.
    """

    def __init__(self, node: DriverNode, prefix: str = ''):
        self.image = node.create_lifecycle_publisher(Image, prefix + 'image_raw', STREAM_QOS)
        self.info = node.create_lifecycle_publisher(CameraInfo, prefix + 'camera_info', LATCHED_QOS)
        self.reset(None)

    def reset(self, given: CameraCalibration | None) -> None:
        """Publish this calibration, whatever the size of the next image."""
        self.given, self._used, self.size, self._info = given, None, None, None

    @property
    def wanted(self) -> bool:
        """Whether image or camera_info has a subscriber."""
        return bool(self.image.get_subscription_count() or self.info.get_subscription_count())

    def fit(self, size: tuple[int, int], known: CameraCalibration | None = None) -> list[str] | None:
        """Make camera_info for images of this size; known: the source's own calibration, where none is given. Returns the warnings if size
        or calibration are new, else None."""
        calibration = self.given or known
        if size == self.size and calibration == self._used:  # a source may make an equal one for each image
            return None
        self.size, self._used, warning = size, calibration, ''
        if calibration is not None and (calibration.width, calibration.height) != size:
            warning = (f'the camera calibration is for {calibration.width} x {calibration.height} px, but images are {size[0]} x {size[1]} '
                       'px: camera_info is published as uncalibrated; set camera_info_url to a calibration of this size')
            calibration = None
        self._info = calibration_to_message(calibration or CameraCalibration(*size))
        return [warning] if warning else []

    def publish(self, frame: Frame, encoding: str, header: Header) -> None:
        """Publish camera_info, and the frame if it has subscribers, under the header."""
        self._info.header = header
        self.info.publish(self._info)
        if self.image.get_subscription_count():
            self.image.publish(image_to_message(frame, encoding, header))


def size_warning(values: dict, size: tuple[int, int]) -> list[str]:
    """The warning if a device gives images of another size (width, height), px, than requested."""
    asked = values['width'] or size[0], values['height'] or size[1]
    return [] if values['source'] != 'device' or asked == size else [
        f'the camera gives {size[0]} x {size[1]} px instead of {asked[0]} x {asked[1]} px; set width, height and '
        'pixel_format to what it offers (v4l2-ctl --list-formats-ext)']


class CalibratedNode(DriverNode):
    """A driver of cameras whose lenses are calibrated: it serves set_camera_info, which camera_calibration calls, and publishes where the
    cameras are. views: by their prefix; '' is image_raw."""

    def __init__(self, name: str, table: Sequence[Parameter], host: Host | None):
        super().__init__(name, table, 'camera', host)
        self.picture = View(self)
        self.views = {'': self.picture}
        self.raw = [self.picture.image, self.picture.info]
        self._transforms = self.create_publisher(TFMessage, '/tf_static', LATCHED_QOS)  # tf2_ros's broadcaster needs a C++ extension

    def serve_calibration(self, parameter: str, prefix: str = '') -> None:
        """Serve <prefix>set_camera_info: write the file that the parameter names, and publish what it holds with the view's next image."""
        def write(request: SetCameraInfo.Request, response: SetCameraInfo.Response) -> SetCameraInfo.Response:
            """Answer with the reason where it cannot be done."""
            url, calibration = self._settings[parameter], calibration_of_info(request.camera_info)
            try:
                if not url or calibration is None:
                    raise BadArgument(f'{parameter} is empty: start the node with the file to write' if not url else
                                      'the camera_info is not calibrated: its width, height and focal lengths must be above 0')
                save_calibration(url, calibration)
            except TactileError as error:
                response.success, response.status_message = False, str(error)
                return response
            if prefix in self.views:
                self.views[prefix].given = calibration
            response.success, response.status_message = True, f'written: {url}'
            return response
        self.create_service(SetCameraInfo, prefix + 'set_camera_info', write)

    def place_cameras(self, frame_id: str, poses: Mapping[str, Pose]) -> None:
        """Publish where the cameras are in the sensor frame frame_id; poses: as of camera_transforms, those that are known."""
        if poses:
            self._transforms.publish(TFMessage(transforms=camera_transforms(frame_id, poses, self.get_clock().now().to_msg())))


class CameraNode(CalibratedNode):
    """One camera."""

    parameters = CAMERA_PARAMETERS

    def __init__(self, host: Host | None = None):
        super().__init__('camera_node', self.parameters, host)
        self.serve_calibration('camera_info_url')

    def open_source(self, values: dict) -> Source:
        """See DriverNode."""
        self.picture.reset(load_calibration(values['camera_info_url']))
        poses = known_pose(values)
        source = self.opened(CAMERA_SOURCES.extended({'topics': lambda values, _clock: TopicSource(self, values['topic'])}), values)
        self.place_cameras(values['frame_id'], poses)
        return source

    def publish(self, stream: Stream, frame: Frame) -> None:
        """See DriverNode."""
        size, encoding = frame.image.shape[1::-1], stream.values['encoding']
        warnings = self.picture.fit(size, stream.source.calibrations()[0])
        if warnings is not None:
            stream.warnings.clear()
            for text in (*size_warning(stream.values, size), *warnings):
                stream.warn(text)
            stream.describe(width=size[0], height=size[1], encoding=encoding or frame.encoding)
        self.picture.publish(frame, encoding, header_of(frame.stamp_ns, optical_frame(stream.values['frame_id'])))
        self.publish_truth(stream, frame.truth, frame.stamp_ns)


main = process_of(CameraNode)
