# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""dual_camera_node: publishes the images of two cameras over one sheet, and the picture stitched from both; a lifecycle node."""
from __future__ import annotations

import sys
from dataclasses import replace

from rclpy.lifecycle import LifecycleNode
from sensor_msgs.msg import TimeReference
from std_msgs.msg import Header

from ..camera.pairs import NAMES, DualSource
from ..errors import BadFrame
from ..frame import CameraCalibration, Frame, PairFrame, as_encoding, load_calibration
from ..frame_names import optical_frame
from ..parameters.drivers import DUAL_CAMERA_PARAMETERS, check_pair
from ..sources.registry import make_dual_source
from ..stitching.calibration import Stitching, load_stitching
from ..stitching.methods import MiddleStitcher, make_stitcher
from .camera_node import CalibratedNode, ImagePublishers, ImageTopic, info_of_size, size_warning
from .driver_node import BaseStream
from .messages.conversions import RIGHT_TIME, header_of, right_time_message
from .runtime.host import Host
from .runtime.diagnostics import Health
from .runtime.ros_defaults import STREAM_QOS
from .runtime.run import run_node
from .topic_source import topic_source


class DualPublishers(ImagePublishers):
    """image_raw and camera_info of the stitched picture and of each view, under left/ and right/, and right/time_reference.

    views: (left, right); empty if the node subscribes to the views; right_time: exposure of the right view of each picture.
    """

    def __init__(self, node: LifecycleNode):
        super().__init__(node)
        self.views: tuple[ImageTopic, ...] = ()
        self._made: tuple[ImageTopic, ...] = ()
        self.right_time = node.create_lifecycle_publisher(TimeReference, RIGHT_TIME, STREAM_QOS)

    def choose_views(self, published: bool) -> None:
        """Publish both views, or only the stitched picture."""
        if published and not self._made:
            self._made = tuple(ImageTopic(self._node, f'{name}/') for name in NAMES)
        self.views = self._made if published else ()

    @property
    def wanted(self) -> bool:
        """Whether any of the topics has a subscriber."""
        return super().wanted or bool(self.right_time.get_subscription_count()) or any(view.wanted for view in self.views)


class DualStream(BaseStream):
    """Publishes the pairs of source.

    stitching: None puts the views side by side; calibrations: of the left and the right camera, None for an unknown one; values: the
    node's parameters.
    """

    def __init__(self, node: LifecycleNode, publishers: DualPublishers, source: DualSource, values: dict,
                 stitching: Stitching | None, calibrations: tuple[CameraCalibration | None, CameraCalibration | None]):
        self._stitcher = None if stitching is None else make_stitcher(values['stitching'], stitching)
        self._calibrations, self._infos, self._sizes = calibrations, {}, {}
        self._missing: tuple[str, ...] = ()
        super().__init__(node, publishers, source, values)
        if stitching is None:
            self._warn('stitching_path is empty: the views are cut and put side by side, image_raw is not metric; calibrate an untouched '
                         'pair and give its file')

    def health(self) -> Health:
        """For /diagnostics: with the offset of the cameras' exposures."""
        health = super().health()
        return replace(health, values={**health.values, 'shutter offset (ms)': self.source.offset_ms})

    def _publish(self, pair: PairFrame) -> None:
        header = header_of(pair.stamp_ns, optical_frame(self._values['frame_id']))
        self._log_missing(pair)
        self._note_sizes(pair)
        for name, topic, frame in zip(NAMES, self._publishers.views, (pair.left, pair.right)):
            if frame is not None:
                own = header_of(frame.stamp_ns, optical_frame(self._values['frame_id'], name))
                topic.publish(frame, self._values['encoding'], own, self._infos[name])
        if pair.left is not None and pair.right is not None:
            self._publishers.right_time.publish(right_time_message(pair.right.stamp_ns, header))
        if self._publishers.picture.wanted:
            self._publish_picture(pair, header)
        self._publish_truth(pair.truth, pair.stamp_ns)
        if self.source.on_demand:
            for topic in (self._publishers.picture, *self._publishers.views):
                topic.wait_until_received()

    def _publish_picture(self, pair: PairFrame, header: Header) -> None:
        frames = [frame for frame in (pair.left, pair.right) if frame is not None]
        encoding = self._values['encoding'] or ('mono8' if all(f.encoding == 'mono8' for f in frames) else 'bgr8')
        left, right = (None if frame is None else as_encoding(frame, encoding) for frame in (pair.left, pair.right))
        try:
            stitcher = self._stitcher or self._side_by_side(pair)
            picture = Frame(stitcher.stitch(left, right), pair.stamp_ns, encoding)
        except BadFrame as error:
            self._warn(f'image_raw: {error}')
            return
        self._publishers.picture.publish(picture, '', header, info_of_size(None, stitcher.size)[0])

    def calibrate(self, prefix: str, calibration: CameraCalibration) -> None:
        """Publish this calibration of a view from its next image on."""
        known = dict(zip(NAMES, self._calibrations)) | {prefix.strip('/'): calibration}
        self._calibrations = tuple(known[name] for name in NAMES)
        self._sizes.pop(prefix.strip('/'), None)

    def _side_by_side(self, pair: PairFrame) -> MiddleStitcher:
        """A stitcher without calibration: it cuts half of the overlap off each view."""
        sizes = tuple(self._sizes.get(name) or next(iter(pair.sizes.values())) for name in NAMES)
        half = self._values['overlap'] / 2
        if sizes[0][1] != sizes[1][1]:
            raise BadFrame(f'views of {sizes[0][1]} and {sizes[1][1]} px height cannot be put side by side; give stitching_path')
        return MiddleStitcher(sizes, (sizes[0][0] - half, half))

    def _note_sizes(self, pair: PairFrame) -> None:
        """Make camera_info for each view with a new size, and complete the description."""
        new = {name: size for name, size in pair.sizes.items() if self._sizes.get(name) != size}
        for name, size in new.items():
            self._sizes[name] = size
            self._infos[name], warning = info_of_size(self._calibrations[NAMES.index(name)], size)
            for text in (warning, size_warning(self._values, size)):
                self._warn(f'{name}: {text}' if text else '')
        if new:
            about = {f'{name}_size': list(size) for name, size in self._sizes.items()}
            stitched = {} if self._stitcher is None else {'width': self._stitcher.size[0], 'height': self._stitcher.size[1]}
            self._describe(stitching_path=self._values['stitching_path'], stitching=self._values['stitching'], **about, **stitched)

    def _log_missing(self, pair: PairFrame) -> None:
        """Log that a camera is lost or back."""
        missing = tuple(name for name in NAMES if name not in pair.sizes)
        if missing != self._missing:
            self._missing = missing
            if missing:
                self._node.get_logger().error(self.source.warning or f'no {missing[0]} camera, its half is black')
            else:
                self._node.get_logger().info('both cameras are back')


class DualCameraNode(CalibratedNode):
    """Two cameras: left/image_raw, right/image_raw and the stitched image_raw."""

    def __init__(self, host: Host | None = None):
        super().__init__('dual_camera_node', DUAL_CAMERA_PARAMETERS, 'camera', host)
        self._outputs = DualPublishers(self)
        for parameter, name in zip(('camera_info_url', 'right_camera_info_url'), NAMES):
            self.serve_calibration(parameter, f'{name}/')

    def open_stream(self, values: dict) -> DualStream:
        """See DriverNode."""
        check_pair(values)
        stitching = load_stitching(values['stitching_path']) if values['stitching_path'] else None
        given = [load_calibration(values[name]) for name in ('camera_info_url', 'right_camera_info_url')]
        self._outputs.choose_views(published=values['source'] != 'topics')
        source = self.opened(lambda parameters, clock: make_dual_source(parameters, clock, lambda topic: topic_source(self, topic)), values)
        self._outputs.place_cameras(values['frame_id'], {} if stitching is None else stitching.poses())
        calibrations = tuple(mine or known for mine, known in zip(given, source.calibrations()))
        return DualStream(self, self._outputs, source, values, stitching, calibrations)


def main(args: list[str] | None = None) -> None:
    """Entry point of dual_camera_node."""
    sys.exit(run_node(DualCameraNode, args))


if __name__ == '__main__':
    main()
