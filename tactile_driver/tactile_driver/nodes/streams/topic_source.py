# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""An image topic as a live source."""
from __future__ import annotations

import threading
from collections import deque

from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import CompressedImage, Image

from ...errors import BadArgument
from ...frame import Frame
from ..messages.conversions import frame_of_message
from ..runtime.adaptive_subscription import AdaptiveSubscription
from ...sources.base.pacing import NS
from ...sources.base.protocol import NothingYet, Source
from ...stamp_gaps import StampGaps

_MOMENT_S = 0.1  # longest wait of read; chosen
_LONGEST_QUEUE = 4  # frames; chosen: the pairing keeps 8 more
_QUEUE = QoSProfile(depth=10)


class TopicSource(Source):
    """The images of a topic, relative to node's namespace: sensor_msgs/CompressedImage if it is named .../compressed, else Image. It
    subscribes only while frames are wanted."""

    live = True

    def __init__(self, node: Node, topic: str):
        if not topic:
            raise BadArgument('topic: source topics needs the names of two image topics')
        self._node, self._topic = node, topic
        self._image: AdaptiveSubscription | None = None
        self._gaps = StampGaps(topic)
        self._queue: deque[Image | CompressedImage] = deque()
        self._arrived = threading.Condition()

    def open(self) -> None:
        """Do nothing: read subscribes."""

    def read(self, wanted: bool = True) -> Frame | None:
        """The next image. Raises NothingYet, or BadFrame for a message that makes no image."""
        self._subscribe(wanted)
        with self._arrived:
            if not self._arrived.wait_for(lambda: self._queue, _MOMENT_S):
                raise NothingYet
            message = self._queue.popleft()
        return frame_of_message(message, f'the image of {self._topic}')

    def _subscribe(self, wanted: bool) -> None:
        if wanted and self._image is None:
            self._gaps.restart()
            self._image = AdaptiveSubscription(self._node, Image, self._topic, self._take, _QUEUE)
        elif not wanted and self._image is not None:
            self._image.close()
            self._image = None
            self._queue.clear()

    def _take(self, message: Image | CompressedImage, _received_ns: int) -> None:
        with self._arrived:
            self._gaps.add(message.header.stamp.sec * NS + message.header.stamp.nanosec)
            self._queue.append(message)
            if len(self._queue) > _LONGEST_QUEUE:
                self._queue.popleft()
                self.skipped += 1
            self._arrived.notify_all()

    def close(self) -> None:
        """Unsubscribe."""
        self._subscribe(False)

    def describe(self) -> dict:
        """The topic, whether it is idle (not subscribed), and the number of lost frames, counted by gaps in the stamps."""
        return {'source': 'topics', 'path': self._topic, 'rate': -1.0, 'idle': self._image is None, 'lost': self._gaps.lost}

    @property
    def remark(self) -> str:
        """The warning that frames are lost in transport, ''."""
        return self._gaps.remark
