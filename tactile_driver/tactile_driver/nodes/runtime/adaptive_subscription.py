# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A subscription that adopts the reliability and durability of its publishers, as rosbag2 and `ros2 topic echo` do."""
from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress

from rclpy.exceptions import InvalidHandle
from rclpy.event_handler import QoSRequestedIncompatibleQoSInfo, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

_AT_ONCE = 20  # messages taken at once before other callbacks run; chosen

Take = Callable[[object, int], None]  # a message, and its time of receipt, ns

Policies = tuple[ReliabilityPolicy, DurabilityPolicy]


def policies_for(publishers: Sequence[TopicEndpointInfo], latched: bool) -> Policies:
    """Policies that fit all publishers: reliable if all are; transient local if latched messages are wanted and all publishers latch.
    Without publishers reliable and volatile: best effort loses large images from another process."""
    reliable = all(each.qos_profile.reliability == ReliabilityPolicy.RELIABLE for each in publishers)
    latched = latched and publishers and all(each.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in publishers)
    return (ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
            DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE)


class AdaptiveSubscription:
    """Calls take with each message on a topic; subscribes again when publishers come or go and the policies no longer fit.

    qos: history and depth; durability: transient local to also receive the last message published before (of a stream that would be an old
    one). Its reliability is ignored. raw: take gets the serialised message.
    """

    def __init__(self, node: Node, kind: type, topic: str, take: Take, qos: QoSProfile, raw: bool = False):
        self._node, self._kind, self._topic, self._take, self._qos, self._raw = node, kind, topic, take, qos, raw
        self._lock = threading.RLock()  # events come in the executor's thread, close() in any
        self._subscription: Subscription | None = None
        self._closed = False
        # The executor does not expect that another thread destroys a subscription whose events it is about to wait for (InvalidHandle).
        self._ending = node.create_guard_condition(self._end)
        self._subscribe(self._fitting())

    @property
    def policies(self) -> Policies:
        """The present reliability and durability."""
        return self._policies

    def close(self) -> None:
        """Take no more messages; the node's executor unsubscribes. Any thread may call this."""
        with self._lock:
            self._closed = True
        with suppress(InvalidHandle):  # the node and all that it had are gone
            self._ending.trigger()

    def _end(self) -> None:
        with self._lock:
            self._unsubscribe()
        self._node.destroy_guard_condition(self._ending)

    def _fitting(self) -> Policies:
        latched = self._qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
        return policies_for(self._node.get_publishers_info_by_topic(self._topic), latched)

    def _subscribe(self, policies: Policies) -> None:
        self._policies = policies
        qos = QoSProfile(history=self._qos.history, depth=self._qos.depth, reliability=policies[0], durability=policies[1])
        events = SubscriptionEventCallbacks(matched=lambda _info: self._adapt(self._fitting()),
                                            incompatible_qos=lambda info: self._adapt(self._weakened(info)))
        self._subscription = self._node.create_subscription(
            self._kind, self._topic, self._taken, qos, raw=self._raw, event_callbacks=events)

    def _unsubscribe(self) -> None:
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
            self._subscription = None

    def _weakened(self, info: QoSRequestedIncompatibleQoSInfo) -> Policies:
        """The present policies without the one that a publisher does not offer; that publisher may not be in the graph yet."""
        reliability, durability = self._policies
        missing = QoSPolicyKind(info.last_policy_kind)
        return (ReliabilityPolicy.BEST_EFFORT if missing == QoSPolicyKind.RELIABILITY else reliability,
                DurabilityPolicy.VOLATILE if missing == QoSPolicyKind.DURABILITY else durability)

    def _adapt(self, policies: Policies) -> None:
        if policies == self._policies:
            return
        self._take_waiting()  # without the lock: take may wait for a lock under which close() is called
        with self._lock:
            if not self._closed:
                self._unsubscribe()
                self._subscribe(policies)

    def _taken(self, message, info: dict) -> None:
        if not self._closed:
            self._take(message, received_ns(info))
            self._take_waiting()

    def _take_waiting(self) -> None:
        """Pass on the messages that wait."""
        subscription = self._subscription
        if subscription is not None and not self._closed:
            for message, info in waiting(subscription):
                self._take(message, received_ns(info))
                if self._closed:
                    return


def received_ns(info: dict) -> int:
    """Time of receipt, ns of this machine's clock; the sending time by the sender's clock if the middleware gives none."""
    return info['received_timestamp'] or info['source_timestamp']


def waiting(subscription: Subscription) -> Iterator[tuple[object, dict]]:
    """(message, info) of up to _AT_ONCE waiting messages: the executor takes 0.2 to 0.4 ms for each (measured), as much as processing a
    small message does. Ends when the subscription is destroyed."""
    for _ in range(_AT_ONCE):
        try:
            with subscription.handle:
                found = subscription.handle.take_message(subscription.msg_type, subscription.raw)
        except InvalidHandle:
            return
        if found is None:
            return
        yield found
