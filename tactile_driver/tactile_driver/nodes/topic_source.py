# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Images that another camera's driver publishes, as a source."""
from __future__ import annotations

import posixpath
import time

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from ..errors import BadArgument
from ..frame import COMPRESSED, CameraCalibration, Frame, calibration_of_info
from ..sources.source import NS, Source
from ..stamp_gaps import StampGaps
from .constants import NODES
from .messages.conversions import frame_of_message
from .received_messages import ReceivedMessages
from .runtime.host import AdaptiveSubscription
from .runtime.ros_defaults import CAMERA_INFO_PATIENCE_S

_QUEUE = QoSProfile(depth=10)
#: Reliable where it is offered: of a player that also sends large images the camera_info was lost for 10 s on a busy machine.
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class TopicSource(Source):
    """The images of a topic, relative to node's namespace: sensor_msgs/CompressedImage if it is named .../compressed, else Image; and
    the camera_info beside it. It subscribes to the images only while frames are wanted. Raises BadArgument for no topic, and for image_raw
    of the node itself."""

    live = True

    def __init__(self, node: Node, topic: str):
        if not topic:
            raise BadArgument('topic: source topics needs the name of an image topic')
        raw = topic.removesuffix(COMPRESSED)
        if node.resolve_topic_name(raw) == node.resolve_topic_name('image_raw'):
            raise BadArgument(f"topic: {topic} is what this node publishes; give the camera's driver another namespace, or name its topic")
        self._node, self._topic = node, topic
        self._info: CameraCalibration | None = None
        self._is_informed, self._first_s = False, 0.0
        self._beside = posixpath.join(posixpath.dirname(raw), 'camera_info')
        self._infos: AdaptiveSubscription | None = None
        self._image: AdaptiveSubscription | None = None
        self._gaps = StampGaps(topic)
        self._received = ReceivedMessages(self, NODES.max_waiting_images)

    def open(self) -> None:
        """Subscribe to the camera_info; read subscribes to the images."""
        self.close()
        self._infos = AdaptiveSubscription(self._node, CameraInfo, self._beside, self._note, _LATCHED)

    def _note(self, message: CameraInfo, _received_ns: int) -> None:
        calibration = calibration_of_info(message)
        if calibration != self._info:
            self._info = calibration
        self._is_informed = True

    def calibrations(self) -> tuple[CameraCalibration | None]:
        """What camera_info said last, None where it is not calibrated."""
        return (self._info,)

    def read(self, wanted: bool = True) -> Frame | None:
        """The next image. Raises NothingYet, or BadFrame for a message that makes no image."""
        self._subscribe(wanted)
        return frame_of_message(self._received.next(lambda: not self._is_early()), f'the image of {self._topic}')

    def _is_early(self) -> bool:
        """Whether the first image still waits for the camera_info that somebody publishes."""
        if self._is_informed or not self._node.count_publishers(self._beside):
            return False
        self._first_s = self._first_s or time.monotonic()
        return time.monotonic() - self._first_s < CAMERA_INFO_PATIENCE_S

    def _subscribe(self, wanted: bool) -> None:
        if wanted and self._image is None:
            self._gaps.reset()
            self._image = AdaptiveSubscription(self._node, Image, self._topic, self._take, _QUEUE, begin=self._gaps.begin)
        elif not wanted and self._image is not None:
            self._image.close()
            self._image = None
            self._received.clear()

    def _take(self, message: Image | CompressedImage, _received_ns: int) -> None:
        self._gaps.add(message.header.stamp.sec * NS + message.header.stamp.nanosec)
        self._received.add(message)

    def close(self) -> None:
        """Unsubscribe."""
        self._subscribe(False)
        if self._infos is not None:
            self._infos.close()
            self._infos = None

    def describe(self) -> dict:
        """The topic, whether it is idle (not subscribed), the number of lost frames, counted by gaps in the stamps, and of those that
        were published before the first one arrived."""
        return {'path': self._topic, 'rate': -1.0, 'idle': self._image is None, 'lost': self._gaps.lost, 'missed': self._gaps.missed}

    @property
    def note(self) -> str:
        """See Source."""
        return self._gaps.note

    @property
    def warning(self) -> str:
        """The warning that frames are lost in transport, ''."""
        return self._gaps.warning
