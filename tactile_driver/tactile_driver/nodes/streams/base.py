# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The base of all streams: an open source is read in one thread and published in another."""
from __future__ import annotations

import threading
import yaml
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode
from rclpy.publisher import Publisher
from rclpy.qos import HistoryPolicy, QoSProfile
from std_msgs.msg import String

from ..health import capture_health
from ..messages.conversions import header_of
from ..messages.ground_truth import GroundTruth
from ..runtime.diagnostics import Health, LogOnce
from ..runtime.host import SharedPublisher
from ..runtime.ros_defaults import LATCHED_QOS
from ...recordings.truth import RecordedTruth
from ...simulation.truth import TruthFrame
from ...sources.base.capture import Capture, CaptureStatus
from ...sources.base.protocol import Source

_TAKE_S = 0.2
_MOST_REMARKS = 10  # chosen: more do not fit a line of /diagnostics; hostile images give thousands
_AND_MORE = 'there were more such problems; they are left out until the node is configured again'
#: longest time that a recording with rate 0 waits for its subscribers' acknowledgement; chosen
ACKNOWLEDGE = Duration(seconds=1)


class RawPublishers:
    """The publishers of every driver beside its raw data: description (latched), and ground_truth/* where its source has it."""

    def __init__(self, node: LifecycleNode):
        self.description = node.create_publisher(String, 'description', LATCHED_QOS)
        self.truth = GroundTruth(node)

    @property
    def wanted(self) -> bool:
        """Whether any of the topics has a subscriber."""
        return self.truth.wanted


class SeriesPublishers(RawPublishers):
    """With a raw topic of which no message may be lost: up to depth of them wait for a subscriber. kind, topic: of the raw data."""

    def __init__(self, node: LifecycleNode, kind: type, topic: str, depth: int):
        super().__init__(node)
        self.raw: Publisher | SharedPublisher = node.create_lifecycle_publisher(
            kind, topic, QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=depth))

    def publish(self, message, waited_s: float) -> None:
        """Publish raw data that have waited waited_s, s: takers in this process skip what is too old for them."""
        if isinstance(self.raw, SharedPublisher):
            self.raw.publish(message, waited_s)
        else:
            self.raw.publish(message)

    @property
    def wanted(self) -> bool:
        """Whether any of the topics has a subscriber."""
        return bool(self.raw.get_subscription_count()) or super().wanted


class BaseStream:
    """Reads an open source in one thread and publishes in another; stop closes the source.

    values: the node's parameters; sensor_type and frame_id go into the description. keep: number of newest frames of a live source that
    wait to be published. slow: why a device may be slower than told, for /diagnostics, with a comma after it.
    """

    keep = 1
    slow = ''

    def __init__(self, node: LifecycleNode, publishers: RawPublishers, source: Source, values: dict):
        self._node, self._publishers, self.source, self._values = node, publishers, source, values
        self._log = LogOnce(node)
        self._remarks: list[str] = []
        self._active = self._stopped = False
        publishers.truth.offer(source.truths)
        self._describe()
        self._capture = Capture(source, self._wanted, self._report, keep=self.keep)
        self._thread = threading.Thread(target=self._run, name='publish', daemon=True)
        self._thread.start()

    @property
    def remark(self) -> str:
        """Warnings about the data, '' if there are none."""
        return '; '.join(text for text in (self.source.remark, *self._remarks) if text)

    def change(self, changes: dict) -> None:
        """Apply changed parameters (see parameters.shared.LIVE)."""
        if 'exposure' in changes:
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
        """State and counts of the capture."""
        return self._capture.status

    def health(self) -> Health:
        """For /diagnostics."""
        return capture_health(self.status, self.source.describe(), self.source.live, self.remark, self.slow)

    def _wanted(self) -> bool:
        try:
            return self._publishers.wanted
        except RuntimeError:  # ROS may shut down before this thread ends
            if self._node.context.ok():
                raise
            return False

    @property
    def _waited_s(self) -> float:
        """How long the present frame has waited, s; 0 for a recording, of which no frame is skipped."""
        return self._capture.waited_s if self.source.live else 0.0

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
            except Exception as error:  # the thread must survive a frame that cannot be published
                if not self._node.context.ok():
                    return
                self._log.error('publish', f'a frame could not be published: {error!r}; the next one is tried')

    def _publish(self, frame) -> None:
        raise NotImplementedError

    def _publish_truth(self, truth: TruthFrame | RecordedTruth | None, stamp_ns: int) -> None:
        """Publish the ground truth of an image with this stamp."""
        if isinstance(truth, RecordedTruth):
            self._publishers.truth.publish_recorded(truth, self._values['frame_id'])
        elif truth is not None:
            header = header_of(stamp_ns, self._values['frame_id'])
            self._publishers.truth.publish(truth, 1 / self.source.describe()['rate'], header)

    def _remark(self, text: str) -> None:
        if len(self._remarks) >= _MOST_REMARKS:
            text = _AND_MORE
        if text and text not in self._remarks:
            self._remarks.append(text)
            self._log.warning(text, text)

    def _describe(self, **known) -> None:
        about = {'sensor_type': self._values['sensor_type'], 'frame_id': self._values['frame_id'], **self.source.describe(), **known}
        self._publishers.description.publish(String(data=yaml.safe_dump(about, sort_keys=False)))
