# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Subscribes to running sensors, and shows those that come later too."""
from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosidl_runtime_py.utilities import get_message

from tactile_driver.nodes.runtime.host import SerializedSubscription
from tactile_driver.recordings.reader import RawMessage

from .constants import VIEW
from .topics import COMMON, sensor_topics

_RAW = 'Image', 'PsdVoltages'
_DRAWN = 'image_annotated'  # left out: the dots are drawn over image_raw, and the sensor is spared the work


class ViewNode(Node):
    """Passes on what sensors publish.

    Parameters
    ----------
    namespaces : sequence of str
        Of the sensors to show; none, all.
    take : callable
        Called with each RawMessage.
    begin : callable
        Called with all sensors (namespace -> topic -> type) when there are new ones.
    """

    def __init__(self, namespaces: Sequence[str], take: Callable[[RawMessage], None], begin: Callable[[dict], None]):
        super().__init__('view')
        self._wanted, self._take, self._begin = {f'/{space.strip("/")}' for space in namespaces}, take, begin
        self._sensors: dict[str, dict[str, str]] = {}
        self._subscribed: set[str] = set()
        self._since: dict[str, float] = {}  # namespace -> when it was seen first
        self._reporting: set[str] = set()  # namespaces with results
        for topic, kind in COMMON.items():
            self._subscribe(topic, kind)
        self.create_timer(VIEW.topic_check_s, self._look)

    def _look(self) -> None:
        """Subscribe to what is new. A played recording starts with its first subscriber: that must be the node that computes results."""
        known = {topic: kinds[0] for topic, kinds in self.get_topic_names_and_types() if not topic.endswith('/' + _DRAWN)}
        sensors = {space: topics for space, topics in sensor_topics(known).items() if not self._wanted or space in self._wanted}
        if sensors != self._sensors:
            self._sensors = sensors
            self._begin(sensors)
        for space, topics in sensors.items():
            since = self._since.setdefault(space, time.monotonic())
            is_working = space in self._reporting or time.monotonic() - since > VIEW.max_wait_s
            for topic, kind in topics.items():
                if topic not in self._subscribed and (is_working or not kind.endswith(_RAW)):
                    self._subscribe(topic, kind)

    def _subscribe(self, topic: str, kind: str) -> None:
        self._subscribed.add(topic)
        static = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        qos = static if topic == '/tf_static' else QoSProfile(depth=VIEW.waiting_messages)
        SerializedSubscription(self, get_message(kind), topic, partial(self._pass, topic, kind), qos)

    def _pass(self, topic: str, kind: str, data: bytes, _received_ns: int) -> None:
        if not kind.endswith(_RAW):
            self._reporting.add(topic.rpartition('/')[0])
        self._take(RawMessage(topic, kind, self.get_clock().now().nanoseconds, data))
