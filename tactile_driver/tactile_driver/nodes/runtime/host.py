# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The process that a node runs in: alone, or with other nodes that receive its messages by a function call instead of the middleware."""
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
    """A publisher with local subscribers ("takers"): functions in its process, called with each message in the publishing thread. The
    middleware gets the message if it has subscribers too. changed: called when takers are added or removed."""

    def __init__(self, publisher: Publisher, changed: Callable[[], None]):
        self._publisher, self._changed = publisher, changed
        self._takers: tuple[Take, ...] = ()

    def attach(self, take: Take) -> Callable[[], None]:
        """Call take with each message from now on; returns a function that ends it."""
        self._set((*self._takers, take))
        return lambda: self._set(tuple(other for other in self._takers if other is not take))

    @property
    def has_takers(self) -> bool:
        """Whether there are local subscribers."""
        return bool(self._takers)

    def _set(self, takers: tuple[Take, ...]) -> None:
        self._takers = takers
        self._changed()

    def get_subscription_count(self) -> int:
        """Number of local and middleware subscribers."""
        return len(self._takers) + self._publisher.get_subscription_count()

    def publish(self, message, waited_s: float = 0.0) -> None:
        """Publish to the middleware first, then to the takers, with a sending time waited_s, s, before now. An inactive lifecycle publisher
        publishes nothing."""
        if not getattr(self._publisher, 'is_activated', True):
            return
        if self._publisher.get_subscription_count():
            self._publisher.publish(message)
        for take in self._takers:
            take(message, time.time_ns() - round(waited_s * _NS))

    def wait_for_all_acked(self, timeout: Duration) -> bool:
        """Wait for the middleware's subscribers; takers are done when publish returns."""
        return self._publisher.wait_for_all_acked(timeout)


class Host:
    """The process as seen by one of its nodes.

    arguments: the node's ROS arguments, such as -r __ns:=/thumb; None: those of the process. parameters: name -> value, overriding
    parameter files. shared: the process's publishers by full topic name; None: nothing is shared. lock: held by callbacks of nodes of the
    same sensor.
    """

    def __init__(self, arguments: Sequence[str] | None = None, parameters: Mapping[str, object] | None = None,
                 shared: dict[str, SharedPublisher] | None = None, lock: threading.RLock | None = None):
        #: arguments of rclpy's Node
        self.options = {'cli_args': None if arguments is None else ['--ros-args', *arguments],
                        'parameter_overrides': [Parameter(name, value=value) for name, value in (parameters or {}).items()]}
        self.lock = lock or threading.RLock()
        self._shared = shared

    def publisher(self, publisher: Publisher, changed: Callable[[], None] = lambda: None) -> Publisher | SharedPublisher:
        """The publisher, shared within the process if the host shares; changed: called when takers are added or removed."""
        if self._shared is None:
            return publisher
        self._shared[publisher.topic_name] = SharedPublisher(publisher, changed)
        return self._shared[publisher.topic_name]

    def has_takers(self, node: Node, topic: str) -> bool:
        """Whether the topic has local subscribers, which the middleware does not report."""
        own = (self._shared or {}).get(node.resolve_topic_name(topic))
        return own is not None and own.has_takers

    @property
    def shares(self) -> bool:
        """Whether other nodes are in the process."""
        return self._shared is not None

    def publishes(self, node: Node, topic: str) -> bool:
        """Whether a node of this process publishes a topic to the others by calls, in which nothing is lost."""
        return node.resolve_topic_name(topic) in (self._shared or {})

    def listen(self, node: Node, kind: type, topic: str, take: Take, qos: QoSProfile) -> Callable[[], None]:
        """Call take with each message on a topic: by the publisher in this process if there is one, else by an AdaptiveSubscription (which
        see for qos). Returns a function that ends it."""
        own = (self._shared or {}).get(node.resolve_topic_name(topic))
        return own.attach(take) if own is not None else AdaptiveSubscription(node, kind, topic, take, qos).close
