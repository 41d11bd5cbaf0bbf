# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""dual_camera_node: publishes the images of two cameras over one sheet, and the picture stitched from both; a lifecycle node."""
from __future__ import annotations

from sensor_msgs.msg import TimeReference
from std_msgs.msg import Header

from ..camera.pairs import NAMES, PairedSource
from ..errors import BadFrame
from ..frame import Frame, PairFrame, as_encoding, load_calibration
from ..frame_names import optical_frame
from ..parameters.drivers import DUAL_CAMERA_PARAMETERS, check_pair
from ..sources.registry import DUAL_CAMERA_SOURCES
from ..sources.source import Clock, Source
from ..stitching.calibration import load_stitching
from ..stitching.methods import MiddleStitcher, make_stitcher
from .camera_node import CalibratedNode, View, size_warning
from .driver_node import Stream
from .messages.conversions import RIGHT_TIME, header_of, right_time_message
from .runtime.host import Host
from .runtime.ros_defaults import STREAM_QOS
from .runtime.run import process_of
from .topic_source import TopicSource


class DualCameraNode(CalibratedNode):
    """Two cameras: left/image_raw, right/image_raw and the stitched image_raw; right/time_reference: exposure of the right view of each
    picture. Views that come from topics are not published again; without a stitching they are cut and put side by side."""

    parameters = DUAL_CAMERA_PARAMETERS

    def __init__(self, host: Host | None = None):
        super().__init__('dual_camera_node', self.parameters, host)
        self._right_time = self.create_lifecycle_publisher(TimeReference, RIGHT_TIME, STREAM_QOS)
        self._always = [*self.raw, self._right_time]
        for parameter, name in zip(('camera_info_url', 'right_camera_info_url'), NAMES):
            self.serve_calibration(parameter, f'{name}/')

    def open_source(self, values: dict) -> Source:
        """See DriverNode."""
        check_pair(values)
        stitching = load_stitching(values['stitching_path']) if values['stitching_path'] else None
        given = [load_calibration(values[name]) for name in ('camera_info_url', 'right_camera_info_url')]
        source = self.opened(DUAL_CAMERA_SOURCES.extended({'topics': self._topics}), values)
        self.place_cameras(values['frame_id'], {} if stitching is None else stitching.poses())
        self._published = NAMES if values['source'] != 'topics' else ()
        self.raw = list(self._always)
        for name, mine, known in zip(self._published, given, source.calibrations()):
            view = self.views.get(f'{name}/') or View(self, f'{name}/')
            view.reset(mine or known)
            self.views[f'{name}/'] = view
            self.raw += [view.image, view.info]
        self._stitcher = None if stitching is None else make_stitcher(values['stitching'], stitching)
        self._missing, self._sizes = (), {}
        return source

    def _topics(self, values: dict, _clock: Clock) -> PairedSource:
        return PairedSource(*(TopicSource(self, values[name]) for name in ('topic', 'right_topic')), values['max_skew'])

    def publish(self, stream: Stream, pair: PairFrame) -> None:
        """See DriverNode."""
        header = header_of(pair.stamp_ns, optical_frame(stream.values['frame_id']))
        self._log_missing(stream, pair)
        self._note_sizes(stream, pair)
        for name, frame in pair.views.items():
            if name in self._published:
                own = header_of(frame.stamp_ns, optical_frame(stream.values['frame_id'], name))
                self.views[f'{name}/'].publish(frame, stream.values['encoding'], own)
        if len(pair.views) == 2:
            self._right_time.publish(right_time_message(pair.right.stamp_ns, header))
        if self.picture.wanted:
            self._publish_picture(stream, pair, header)
        self.publish_truth(stream, pair.truth, pair.stamp_ns)

    def _publish_picture(self, stream: Stream, pair: PairFrame, header: Header) -> None:
        encoding = stream.values['encoding'] or ('mono8' if all(f.encoding == 'mono8' for f in pair.views.values()) else 'bgr8')
        left, right = (None if frame is None else as_encoding(frame, encoding) for frame in (pair.left, pair.right))
        try:
            stitcher = self._stitcher or self._side_by_side(stream, pair)
            picture = Frame(stitcher.stitch(left, right), pair.stamp_ns, encoding)
        except BadFrame as error:
            stream.warn(f'image_raw: {error}')
            return
        self.picture.fit(stitcher.size)
        self.picture.publish(picture, '', header)

    def _side_by_side(self, stream: Stream, pair: PairFrame) -> MiddleStitcher:
        """A stitcher without calibration: it cuts half of the overlap off each view."""
        stream.warn('stitching_path is empty: the views are cut and put side by side, image_raw is not metric; calibrate an untouched pair '
                    'and give its file')
        sizes = tuple(self._sizes.get(name) or next(iter(pair.sizes.values())) for name in NAMES)
        half = stream.values['overlap'] / 2
        if sizes[0][1] != sizes[1][1]:
            raise BadFrame(f'views of {sizes[0][1]} and {sizes[1][1]} px height cannot be put side by side; give stitching_path')
        return MiddleStitcher(sizes, (sizes[0][0] - half, half))

    def _note_sizes(self, stream: Stream, pair: PairFrame) -> None:
        """Make camera_info for each view with a new size, and complete the description."""
        known = dict(self._sizes)
        self._sizes |= pair.sizes
        for name, size in pair.sizes.items():
            warnings = (self.views[f'{name}/'].fit(size) or []) if name in self._published else []
            for text in (*warnings, *size_warning(stream.values, size)):
                stream.warn(f'{name}: {text}')
        if self._sizes != known:
            about = {f'{name}_size': list(size) for name, size in self._sizes.items()}
            stitched = {} if self._stitcher is None else {'width': self._stitcher.size[0], 'height': self._stitcher.size[1]}
            stream.describe(stitching_path=stream.values['stitching_path'], stitching=stream.values['stitching'], **about, **stitched)

    def _log_missing(self, stream: Stream, pair: PairFrame) -> None:
        """Log that a camera is lost or back."""
        missing = tuple(name for name in NAMES if name not in pair.views)
        if missing != self._missing:
            self._missing = missing
            if missing:
                self.get_logger().error(stream.source.warning or f'no {missing[0]} camera, its half is black')
            else:
                self.get_logger().info('both cameras are back')


main = process_of(DualCameraNode)
