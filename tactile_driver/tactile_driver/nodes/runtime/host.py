# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where a node runs: alone in its process, or among others, to which its messages go by a call instead of through the middleware."""
from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile

from .adaptive_subscription import AdaptiveSubscription, Take

_NS = 1e9


class SharedPublisher:
    """A publisher with takers in its own process: they are called with each message, in the thread that publishes it; the middleware gets
    it where somebody else subscribes. changed: called when takers come or go."""

    def __init__(self, publisher: Publisher, changed: Callable[[], None]):
        self._publisher, self._changed = publisher, changed
        self._takers: tuple[Take, ...] = ()

    def attach(self, take: Take) -> Callable[[], None]:
        """Call take with each message from now on; what ends it."""
        self._set((*self._takers, take))
        return lambda: self._set(tuple(other for other in self._takers if other is not take))

    @property
    def has_takers(self) -> bool:
        """Whether there are any."""
        return bool(self._takers)

    def _set(self, takers: tuple[Take, ...]) -> None:
        self._takers = takers
        self._changed()

    def get_subscription_count(self) -> int:
        """Of both kinds."""
        return len(self._takers) + self._publisher.get_subscription_count()

    def publish(self, message, waited_s: float = 0.0) -> None:
        """To the middleware first: takers work on it, for whom it was sent waited_s, s, ago. Nothing, while a lifecycle publisher is not
        active."""
        if not getattr(self._publisher, 'is_activated', True):
            return
        if self._publisher.get_subscription_count():
            self._publisher.publish(message)
        for take in self._takers:
            take(message, time.time_ns() - round(waited_s * _NS))

    def wait_for_all_acked(self, timeout: Duration) -> bool:
        """Takers are done when publish is."""
        return self._publisher.wait_for_all_acked(timeout)


class Host:
    """What a node is told about its process.

    arguments: ROS arguments of the node alone, as -r __ns:=/thumb, those of the process where it is None; parameters: name -> value, which
    go before those of any file; shared: publishers of the process by full topic name, None where nothing is shared; lock: to be held by
    whoever works for nodes of the same sensor.
    """

    def __init__(self, arguments: Sequence[str] | None = None, parameters: Mapping[str, object] | None = None,
                 shared: dict[str, SharedPublisher] | None = None, lock: threading.RLock | None = None):
        #: arguments of rclpy's Node
        self.options = {'cli_args': None if arguments is None else ['--ros-args', *arguments],
                        'parameter_overrides': [Parameter(name, value=value) for name, value in (parameters or {}).items()]}
        self.lock = lock or threading.RLock()
        self._shared = shared

    def publisher(self, publisher: Publisher, changed: Callable[[], None] = lambda: None) -> Publisher | SharedPublisher:
        """The publisher for the node's use; changed: called when takers in the process come or go."""
        if self._shared is None:
            return publisher
        self._shared[publisher.topic_name] = SharedPublisher(publisher, changed)
        return self._shared[publisher.topic_name]

    def has_takers(self, node: Node, topic: str) -> bool:
        """Whether anybody in this process takes the messages on a topic by a call: the middleware does not tell of those."""
        own = (self._shared or {}).get(node.resolve_topic_name(topic))
        return own is not None and own.has_takers

    def listen(self, node: Node, kind: type, topic: str, take: Take, qos: QoSProfile) -> Callable[[], None]:
        """Call take with each message on a topic, by the publisher in this process where there is one, else with the reliability
        that publishers offer; what ends it. qos: as of AdaptiveSubscription."""
        own = (self._shared or {}).get(node.resolve_topic_name(topic))
        return own.attach(take) if own is not None else AdaptiveSubscription(node, kind, topic, take, qos).close
