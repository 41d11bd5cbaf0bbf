# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the nodes that draw for RViz share: markers and pictures on demand, messages of equal stamp, the frame of a part, diagnostics."""
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
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import Image
from std_msgs.msg import Header
from tactile_driver.errors import BadArgument, TactileError
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import image_to_message, stamp_ns_of, static_transform
from tactile_driver.nodes.messages.images import message_type
from tactile_driver.nodes.runtime.defect_guard import DefectGuard, guard_services
from tactile_driver.nodes.runtime.diagnostics import OK, Health, LogOnce, NodeDiagnostics
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.nodes.runtime.ros_defaults import LATCHED_QOS, STREAM_QOS
from tactile_driver.parameters.table import Parameter
from tactile_perception.nodes.messages.checks import check_message
from tactile_perception.nodes.messages.conversions import stamp_seconds
from tactile_perception.work_log import WorkLog
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from ..visualization.markers import STALE_S, MarkerSet

_BACK_NS, _SILENT_NS = 1_000_000_000, 2_000_000_000  # chosen


class StampSync:
    """Collects messages by stamp and passes on the sets that are complete, and no others.

    done: called with a dict of messages by topic; expected: returns the topics of a complete set; one that had nothing for 2 s of stamps
    is left out; patience: number of waiting sets above which the oldest is dropped. Sets older than the one passed on are dropped, too.
    """

    def __init__(self, done: Callable[[dict], None], expected: Callable[[], Collection[str]], patience: int = 30):
        self._done, self._expected, self._patience = done, expected, patience
        self._begin_anew(0)

    def _begin_anew(self, stamp_ns: int) -> None:
        self._sets: dict[int, dict] = {}
        self._begin, self._last = stamp_ns, -1
        self._heard: dict[str, int] = {}  # topic -> its last stamp

    def add(self, topic: str, stamp_ns: int, message: object) -> None:
        """Add one message. A stamp, ns, that goes back by more than 1 s or leaps by 2 s begins anew; other late messages are dropped."""
        if not self._heard or not -_BACK_NS < stamp_ns - self._heard.get(topic, stamp_ns) < _SILENT_NS:
            self._begin_anew(stamp_ns)
        self._heard[topic] = stamp_ns
        if stamp_ns <= self._last:
            return
        found = self._sets.setdefault(stamp_ns, {})
        found[topic] = message
        if found.keys() >= {name for name in self._expected() if stamp_ns - self._heard.get(name, self._begin) < _SILENT_NS}:
            self._last = stamp_ns
            self._sets = {stamp: kept for stamp, kept in self._sets.items() if stamp > stamp_ns}
            self._done(found)
        elif len(self._sets) > self._patience:
            del self._sets[min(self._sets)]


_WARNED_S = 3.0  # chosen: so long a warning holds, of which nodes report once a second


class DrawingNode(Node):
    """Publishes markers and image_annotated, each while it has subscribers.

    Subclasses set self.markers, with methods frame (of messages) and alone (of the warning), and implement picture and follow_demand.

    What the other nodes of the sensor's namespace warn of on /diagnostics becomes self.markers.warning, which is shown even when nothing
    else is.

    table: the node's parameters; host: of the process. Raises BadArgument for an invalid parameter.
    """

    def __init__(self, name: str, table: Sequence[Parameter], host: Host | None = None):
        self.host = host or Host()
        super().__init__(name, **self.host.options)
        self.settings = NodeParameters(self, table)
        if self.settings.problems:
            raise BadArgument(f'{name}: ' + '; '.join(self.settings.problems.values()))
        self.say, self.log, self.guard = LogOnce(self), WorkLog('results', by_call=self.host.shares), DefectGuard(self)
        self.marker_output, self.picture_output = self._demanded(MarkerArray, 'markers'), self._demanded(Image, 'image_annotated')
        self._drawn_s = -math.inf  # when markers were last published
        self._reported: dict[str, tuple[str, float]] = {}  # node -> its warning, '' for none, and when it came
        self.create_subscription(DiagnosticArray, '/diagnostics', self._take_diagnostics, 10)
        self._diagnostics = NodeDiagnostics(self, 'drawing', self.get_namespace().strip('/') or 'none', self._examine)
        guard_services(self)

    def _demanded(self, kind: type, topic: str) -> Publisher:
        """A publisher that calls follow_demand when its subscribers change."""
        matched = PublisherEventCallbacks(matched=lambda _info: self.follow_demand())
        return self.create_publisher(kind, topic, STREAM_QOS, event_callbacks=matched)

    @property
    def watched(self) -> bool:
        """Whether somebody looks at markers or pictures."""
        return self.marker_output.get_subscription_count() > 0 or self.picture_output.get_subscription_count() > 0

    def draw_markers(self, header: Header, found: dict) -> None:
        """Publish the markers of messages by topic, if somebody looks at them; header: of the data drawn."""
        if self.marker_output.get_subscription_count():
            self._publish(self.marker_output, header, lambda: self.markers.frame(header, found))
            self._drawn_s = time.monotonic()

    def draw_picture(self, header: Header, found: dict) -> None:
        """Publish the picture of messages by topic, if somebody looks at it. One that cannot be drawn is counted and logged once."""
        if not self.picture_output.get_subscription_count():
            return
        try:
            self._publish(self.picture_output, header,
                          lambda: image_to_message(Frame(self.picture(found), 0, 'bgr8'), 'bgr8', header))
        except TactileError as error:
            self.log.refuse(str(error))
            self.say.error('image', f'no picture: {error}')
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
        warnings = [text for text, reported_s in self._reported.values() if text and now - reported_s < _WARNED_S]
        self.markers.warning = warnings[0] if warnings else ''
        if warnings and now - self._drawn_s > STALE_S:
            self.marker_output.publish(self.markers.alone(Header(frame_id=self.settings['frame_id'])))

    def _examine(self) -> Health:
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

    def follow_demand(self) -> None:
        """Subscribe to the inputs of the outputs that have subscribers, and to no others."""
        raise NotImplementedError

    def picture(self, found: dict) -> np.ndarray:
        """The annotated picture (H, W, 3) uint8 BGR of messages by topic. Raises TactileError."""
        raise NotImplementedError

    def publish_place(self, name: str, translation: Sequence[float]) -> None:
        """Publish frame <sensor>_<name> at translation, m, in the sensor frame on /tf_static; once for each node."""
        frame = self.settings['frame_id']
        transform = static_transform(frame, f'{frame}_{name}', translation, stamp=self.get_clock().now().to_msg())
        self._transform_output = self.create_publisher(TFMessage, '/tf_static', LATCHED_QOS)
        self._transform_output.publish(TFMessage(transforms=[transform]))


_KEPT = 20  # messages per topic, chosen: among these the node looks for equal stamps


class ResultsDrawingNode(DrawingNode):
    """Draws what has all inputs of one stamp, at most as often as parameter rate says. inputs: topic -> type; markers: made of the
    settings; other parameters: as of DrawingNode."""

    inputs: Mapping[str, type]

    def __init__(self, name: str, table: Sequence[Parameter], markers: Callable[[NodeParameters], MarkerSet], host: Host | None = None):
        super().__init__(name, table, host)
        self.markers = markers(self.settings)
        self._subscriptions_kept, self._due_s = [], 0.0
        self._sync = StampSync(self._complete, lambda: self.inputs, _KEPT)
        self.follow_demand()

    def follow_demand(self) -> None:
        """Subscribe while somebody looks."""
        kept = self._subscriptions_kept
        if self.watched and not kept:
            for topic, kind in self.inputs.items():
                qos = qos_profile_sensor_data if topic == 'image_raw' else QoSProfile(depth=_KEPT)
                kind = message_type(kind, self.resolve_topic_name(topic))
                kept.append(self.create_subscription(kind, topic, partial(self._take, topic), qos))
        while kept and not self.watched:
            self.destroy_subscription(kept.pop())

    def _take(self, topic: str, message) -> None:
        self.try_message(topic, message, lambda: self._sync.add(topic, stamp_ns_of(message.header), message))

    def _complete(self, found: dict) -> None:
        now = time.monotonic()
        if found.keys() == self.inputs.keys() and now >= self._due_s:
            self._due_s = now + 1 / self.settings['rate']
            self.draw_markers(found['contacts'].header, found)
            self.draw_picture(found.get('image_raw', found['contacts']).header, found)
