# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The nodes that draw for RViz, one for each kind of sensor: markers and pictures of messages with equal stamps, on demand; warnings."""
from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from tactile_driver.errors import BadArgument, BadFrame, TactileError
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import image_to_message, stamp_ns_of, static_transform
from tactile_driver.nodes.messages.images import grey_to_array, image_to_array
from tactile_driver.nodes.runtime.defect_guard import DefectGuard, guard_services
from tactile_driver.nodes.runtime.diagnostics import OK, Health, LogOnce, NodeDiagnostics
from tactile_driver.nodes.runtime.host import AdaptiveSubscription, Host
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.nodes.runtime.ros_defaults import LATCHED_QOS, STREAM_QOS, steady_timer
from tactile_driver.parameters.table import Parameter
from tactile_driver.stitching.calibration import Stitching, load_stitching
from tactile_msgs.msg import Contacts, DotTracks
from tactile_perception.common.messages import POINTS, RESULTS, WITHOUT_SLIP
from tactile_perception.core.messages import camera_matrices, check_message, stamp_seconds
from tactile_perception.core.work_log import WorkLog

from ..parameters.table import (
    FINGER_MARKERS_PARAMETERS,
    FORCE_MARKERS_PARAMETERS,
    MARKERS_PARAMETERS,
    SURFACE_MARKERS_PARAMETERS,
    TAXEL_MARKERS_PARAMETERS,
)
from ..visualization.constants import DRAWING
from ..visualization.markers import (
    DotMarkers,
    FingerMarkers,
    ForceMarkers,
    MarkerSet,
    SurfaceMarkers,
    TaxelMarkers,
    forces_of,
    positions_of,
)
from ..visualization.pictures import (
    ARRAY_LEGEND,
    SURFACE_LEGEND,
    Projection,
    annotate,
    annotation_of,
    array_picture,
    camera_info_key,
    finger_picture,
    plane_projection,
    projection,
    taxels_picture,
)
from .constants import BRINGUP


class StampSync:
    """Collects messages by stamp and passes on the sets that are complete, and no others.

    Sets older than the last one that was passed on are dropped. A topic that has been silent for 2 s of stamps is not waited for.

    Parameters
    ----------
    done : callable
        Called with a dict of messages by topic.
    expected : callable
        Returns the topics of a complete set.
    rate : float
        Maximum rate of the sets, in Hz of the stamps; 0 for all.
    """

    def __init__(self, done: Callable[[dict], None], expected: Callable[[], Collection[str]], rate: float = 0.0):
        self._done, self._expected, self._done_ns = done, expected, -math.inf
        self._min_period_ns = BRINGUP.min_period * 1e9 / rate if rate else 0.0
        self._reset(0)

    def _reset(self, stamp_ns: int) -> None:
        self._sets: dict[int, dict] = {}
        self._begin, self._last = stamp_ns, -1
        self._heard: dict[str, int] = {}  # topic -> its last stamp

    def add(self, topic: str, stamp_ns: int, message: object) -> None:
        """Add one message. A stamp (ns) that is 1 s earlier or 2 s later than the last one resets; other late messages are dropped."""
        if not self._heard or not -BRINGUP.max_late_ns < stamp_ns - self._heard.get(topic, stamp_ns) < BRINGUP.max_gap_ns:
            self._reset(stamp_ns)
        self._heard[topic] = stamp_ns
        if stamp_ns <= self._last:
            return
        found = self._sets.setdefault(stamp_ns, {})
        found[topic] = message
        if found.keys() >= {name for name in self._expected() if stamp_ns - self._heard.get(name, self._begin) < BRINGUP.max_gap_ns}:
            self._last = stamp_ns
            self._sets = {stamp: kept for stamp, kept in self._sets.items() if stamp > stamp_ns}
            if not 0 <= stamp_ns - self._done_ns < self._min_period_ns:
                self._done_ns = stamp_ns
                self._done(found)
        elif len(self._sets) > BRINGUP.max_sets:
            del self._sets[min(self._sets)]


_QUEUE = QoSProfile(depth=10)
_RAW = 'image_raw'


class DrawingNode(Node):
    """Publishes markers and image_annotated of messages with equal stamps, each while it has subscribers.

    Subclasses set self.markers and implement picture. marked, pictured: topic -> type of the messages that markers and pictures show;
    marker_rate, picture_rate: names of the parameters with their maximum rates, '' for every set.

    A warning of another node in the sensor's namespace on /diagnostics becomes self.markers.warning, which is shown even without results.

    table: the node's parameters; host: of the process. Raises BadArgument for an invalid parameter.
    """

    marked: Mapping[str, type] = {}
    pictured: Mapping[str, type] = {}
    marker_rate = picture_rate = ''
    markers: MarkerSet

    def __init__(self, name: str, table: Sequence[Parameter], host: Host | None = None):
        self.host = host or Host()
        super().__init__(name, **self.host.options)
        self.settings = NodeParameters(self, table)
        if self.settings.problems:
            raise BadArgument(f'{name}: ' + '; '.join(self.settings.problems.values()))
        for vector in ('text.side', 'text.up', 'camera.rotation', 'camera.translation'):
            if any(each.name == vector for each in table) and len(self.settings[vector]) != 3:
                raise BadArgument(f'parameter {vector} of {name} has {len(self.settings[vector])} numbers, but must have three')
        self.say, self.log, self.guard = LogOnce(self), WorkLog('results', by_call=self.host.shares), DefectGuard(self)
        self.inputs: dict[str, AdaptiveSubscription] = {}
        self.expected: set[str] = set()
        self._asked_s = math.nan  # s, time since which an output has subscribers
        marker_rate, picture_rate = (self.settings[name] if name else 0.0 for name in (self.marker_rate, self.picture_rate))
        self._marker_sync = StampSync(self._draw_markers, lambda: self.expected & self.marked.keys(), marker_rate)
        self._picture_sync = StampSync(self._draw_picture, lambda: self.expected & self.pictured.keys(), picture_rate)
        self.marker_output, self.picture_output = self._demanded(MarkerArray, 'markers'), self._demanded(Image, 'image_annotated')
        # while there is demand: each call wakes the executor
        self.look_timer = steady_timer(self, BRINGUP.endpoint_check_s, self.follow_demand)
        self._drawn_s = -math.inf  # when markers were last published
        self._reported: dict[str, tuple[str, float]] = {}  # node -> its warning, '' for none, and when it came
        self.create_subscription(DiagnosticArray, '/diagnostics', self._take_diagnostics, 10)
        self._diagnostics = NodeDiagnostics(self, 'drawing', self.get_namespace().strip('/') or 'none', self.examine)
        guard_services(self)

    def _demanded(self, kind: type, topic: str) -> Publisher:
        """A publisher that calls follow_demand when its subscribers change."""
        matched = PublisherEventCallbacks(matched=lambda _info: self.follow_demand())
        return self.create_publisher(kind, topic, STREAM_QOS, event_callbacks=matched)

    @property
    def watched(self) -> bool:
        """Whether markers or pictures have subscribers."""
        return self.marker_output.get_subscription_count() > 0 or self.picture_output.get_subscription_count() > 0

    def follow_demand(self) -> None:
        """Subscribe to the inputs of the outputs that have subscribers, and to no others, and note which of them have publishers."""
        wanted = {**(self.marked if self.marker_output.get_subscription_count() else {}),
                  **(self.pictured if self.picture_output.get_subscription_count() else {})}
        self.expected = {topic for topic in wanted if topic == _RAW or self.count_publishers(topic)}
        if math.isnan(self._asked_s):
            self._asked_s = time.monotonic()
        # Subscribe to raw data after the perception node: a played recording starts with its first subscriber.
        is_processed = self.count_subscribers(_RAW) or self.host.has_takers(self, _RAW)
        if not is_processed and time.monotonic() - self._asked_s < BRINGUP.max_wait_s:
            wanted.pop(_RAW, None)
        for topic in wanted.keys() - self.inputs.keys():
            self.inputs[topic] = AdaptiveSubscription(self, wanted[topic], topic, partial(self.take, topic), _QUEUE)
        for topic in self.inputs.keys() - wanted.keys():
            self.inputs.pop(topic).close()
        if not self.watched:
            self._asked_s = math.nan
            self.look_timer.cancel()
        elif self.look_timer.is_canceled():
            self.look_timer.reset()

    def take(self, topic: str, message, _received_ns: int) -> None:
        """A message on an input."""
        self.try_message(topic, message, lambda: self._add(topic, stamp_ns_of(message.header), message))

    def _add(self, topic: str, stamp_ns: int, message) -> None:
        if topic in self.marked and self.marker_output.get_subscription_count():
            self._marker_sync.add(topic, stamp_ns, message)
        if self.picture_output.get_subscription_count():
            self._picture_sync.add(topic, stamp_ns, message)

    def _draw_markers(self, found: dict) -> None:
        """Publish the markers of messages by topic. Their header is that of a result, since a camera's image is in another frame."""
        header = next((message for topic, message in found.items() if topic != _RAW), found.get(_RAW)).header
        self._publish(self.marker_output, header, lambda: self.markers.frame(header, found))
        self._drawn_s = time.monotonic()

    def _draw_picture(self, found: dict) -> None:
        """Publish the picture of messages by topic. An error is counted and logged once."""
        if _RAW in self.pictured and _RAW not in found:
            return
        header = (found.get(_RAW) or next(iter(found.values()))).header
        try:
            self._publish(self.picture_output, header,
                          lambda: image_to_message(Frame(self.picture(found), 0, 'bgr8'), 'bgr8', header))
        except TactileError as error:
            self.log.refuse(str(error))
            self.say.error('image', f'image_annotated was not drawn: {error}')
        else:
            self.say.settle('image')

    def _publish(self, output: Publisher, header: Header, draw: Callable[[], object]) -> None:
        """Publish the result of draw and log its time."""
        begin = time.perf_counter()
        output.publish(draw())
        self.log.add(time.perf_counter() - begin, 1e-9 * self.get_clock().now().nanoseconds - stamp_seconds(header))

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        if not self.marker_output.get_subscription_count():
            return
        own, now = self.get_namespace().rstrip('/'), time.monotonic()
        for status in message.status:
            space, _, node = status.name.split(':')[0].rpartition('/')
            if space == own and node != self.get_name():
                self._reported[status.name] = '' if status.level == OK else status.message, now
        warnings = [text for text, reported_s in self._reported.values() if text and now - reported_s < BRINGUP.warning_s]
        self.markers.warning = warnings[0] if warnings else ''
        if warnings and now - self._drawn_s > DRAWING.marker_s:
            self.marker_output.publish(self.markers.alone(Header(frame_id=self.settings['frame_id'])))

    def examine(self) -> Health:
        """For /diagnostics."""
        return self.log.health(not self.watched, values={'defects met': self.guard.caught})

    def try_message(self, topic: str, message, work: Callable[[], None]) -> None:
        """Check a message and call work(); a message that fails is counted, logged once and skipped."""
        try:
            check_message(message)
            work()
        except TactileError as error:
            self.log.refuse(str(error))
            self.say.error(topic, f'message of {topic} refused: {error}')
        except Exception as error:
            if not self.context.ok():  # ROS is shutting down
                raise
            self.log.refuse(self.guard.catch(error, topic))
        else:
            self.say.settle(topic)

    def picture(self, found: dict) -> np.ndarray:
        """The annotated picture (H, W, 3) uint8 BGR of messages by topic. Raises TactileError."""
        raise NotImplementedError

    def publish_frame(self, name: str, z: float) -> None:
        """Publish the frame <sensor>_<name> at height z (m) over the sensor frame on /tf_static; call it once for each node."""
        frame = self.settings['frame_id']
        transform = static_transform(frame, f'{frame}_{name}', (0.0, 0.0, z), stamp=self.get_clock().now().to_msg())
        self._transform_output = self.create_publisher(TFMessage, '/tf_static', LATCHED_QOS)
        self._transform_output.publish(TFMessage(transforms=[transform]))


_DOTS = {'dots': DotTracks, **RESULTS}


class MarkersNode(DrawingNode):
    """markers_node, for sensors with dots: draws the markers of every stamp, and pictures at the rate picture_rate at most.

    It also publishes a frame on /tf_static, so that RViz knows the sensor frame if the pose of the camera is unknown."""

    marked, pictured, picture_rate = _DOTS, {**_DOTS, _RAW: Image}, 'picture_rate'
    parameters = MARKERS_PARAMETERS

    def __init__(self, host: Host | None = None):
        super().__init__('markers_node', self.parameters, host)
        self.markers = DotMarkers(self.settings)
        self.publish_frame('markers', 0.0)
        self._project: Projection | None = None
        self._camera = None  # camera_info_key of its calibration
        self._info: AdaptiveSubscription | None = None
        self._stitching = _stitching_in(self.settings['calibration'])

    def follow_demand(self) -> None:
        """See DrawingNode. Also subscribe to camera_info while images are subscribed."""
        super().follow_demand()
        if _RAW in self.inputs and self._info is None:
            self._info = AdaptiveSubscription(self, CameraInfo, 'camera_info', self.take_camera_info, LATCHED_QOS)
        elif _RAW not in self.inputs and self._info is not None:
            self._info.close()
            self._info = None

    def _add(self, topic: str, stamp_ns: int, message) -> None:
        if topic == 'dots' and len(message.id) and not len(message.x) and 'points' not in self.marked:
            points = {'points': PointCloud2}  # they have the positions of the dots of a gel or of pins
            self.marked, self.pictured = self.marked | points, self.pictured | points
        super()._add(topic, stamp_ns, message)

    def take_camera_info(self, message: CameraInfo, _received_ns: int) -> None:
        """A message on camera_info."""
        self.try_message('camera_info', message, lambda: self._take_camera(message))

    def _take_camera(self, message: CameraInfo) -> None:
        if self._camera != camera_info_key(message):
            self._project = projection(camera_matrices(message), self.settings['camera.rotation'], self.settings['camera.translation'],
                                       self._stitching)
            self._camera = camera_info_key(message)

    def picture(self, found: dict) -> np.ndarray:
        """See DrawingNode."""
        project = self._project
        if {'points', 'dots'} <= found.keys() and len(points := positions_of(found['points'])) == len(found['dots'].id):
            project = plane_projection(points, np.column_stack([found['dots'].u, found['dots'].v]))
        return annotate(image_to_array(found[_RAW]), annotation_of(found, project))


def _stitching_in(calibration: str) -> Stitching | None:
    """Stitching of a calibration file; None without a file or for an invalid one, which the perception node reports."""
    try:
        return load_stitching(calibration) if calibration else None
    except BadArgument:
        return None


class SurfaceMarkersNode(DrawingNode):
    """surface_markers_node, for a gel whose whole surface is measured: also publishes the frame of its surface on /tf_static."""

    marked = WITHOUT_SLIP
    pictured = {_RAW: Image, **{topic: kind for topic, kind in WITHOUT_SLIP.items() if topic != 'points'}}
    marker_rate = picture_rate = 'rate'
    parameters = SURFACE_MARKERS_PARAMETERS

    def __init__(self, host: Host | None = None):
        super().__init__('surface_markers_node', self.parameters, host)
        self.markers = SurfaceMarkers(self.settings)
        self.publish_frame('surface', 0.0)

    def picture(self, found: dict) -> np.ndarray:
        """The image with the results."""
        image, scale = image_to_array(found[_RAW]), self.settings['gel.scale']
        middle = 0.5 * np.array([image.shape[1] - 1, image.shape[0] - 1])
        return annotate(image, annotation_of(found, (lambda xyz: xyz[:, :2] / scale + middle) if scale > 0 else None, SURFACE_LEGEND))


class ForceMarkersNode(DrawingNode):
    """force_markers_node, of taxels that measure force vectors: also publishes the frame of its surface on /tf_static."""

    marked = pictured = RESULTS | POINTS
    marker_rate = picture_rate = 'rate'
    parameters = FORCE_MARKERS_PARAMETERS

    def __init__(self, host: Host | None = None):
        super().__init__('force_markers_node', self.parameters, host)
        self.markers = ForceMarkers(self.settings)
        self.publish_frame('surface', 0.0)

    def picture(self, found: dict) -> np.ndarray:
        """The taxels from above in colours, with what was found."""
        if 'points' not in found:
            raise BadFrame('points are missing: nothing can be drawn')
        positions, (forces, pressed) = positions_of(found['points']), forces_of(found['points'])
        image, project = taxels_picture(positions, forces, pressed, self.settings['full_taxel_force'])
        return annotate(image, annotation_of(found, project, SURFACE_LEGEND))


class FingerMarkersNode(DrawingNode):
    """finger_markers_node, for a PSD finger: also publishes the frame at its tip on /tf_static."""

    marked = pictured = {'contacts': Contacts}
    marker_rate = picture_rate = 'rate'
    parameters = FINGER_MARKERS_PARAMETERS

    def __init__(self, host: Host | None = None):
        super().__init__('finger_markers_node', self.parameters, host)
        self.markers = FingerMarkers(self.settings)
        self.publish_frame('tip', self.settings['radius'])

    def picture(self, found: dict) -> np.ndarray:
        """See DrawingNode."""
        return finger_picture(found)


class TaxelMarkersNode(DrawingNode):
    """taxel_markers_node, for an array: also publishes the frame of its taxels on /tf_static."""

    marked = pictured = {_RAW: Image, **RESULTS}
    marker_rate = picture_rate = 'rate'
    parameters = TAXEL_MARKERS_PARAMETERS

    def __init__(self, host: Host | None = None):
        super().__init__('taxel_markers_node', self.parameters, host)
        self.markers = TaxelMarkers(self.settings)
        self.publish_frame('taxels', -self.settings['cell_height'])

    def picture(self, found: dict) -> np.ndarray:
        """The taxels as colours, with the results."""
        values, pitch = grey_to_array(found[_RAW], 'taxel image'), self.settings['pitch']
        middle = 0.5 * np.array([values.shape[1] - 1, values.shape[0] - 1])
        what = annotation_of(found, lambda xyz: xyz[:, :2] / pitch + middle, ARRAY_LEGEND, self.settings['flow_scale'])
        return annotate(array_picture(values, self.settings['full_value']), what)
