# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A subscription with the reliability that its publishers offer, and the durability, as rosbag2 and `ros2 topic echo` choose them."""
from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence

from rclpy.exceptions import InvalidHandle
from rclpy.event_handler import QoSRequestedIncompatibleQoSInfo, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

_AT_ONCE = 20  # messages, after which others than this subscription have their turn

Take = Callable[[object, int], None]  # a message, and when it was received, ns

Policies = tuple[ReliabilityPolicy, DurabilityPolicy]


def policies_for(publishers: Sequence[TopicEndpointInfo], latched: bool) -> Policies:
    """What fits all publishers: reliable where all are; where latched messages are wanted transient local, if all are. Without any,
    reliable and volatile: large images from another process do not survive a best-effort subscription."""
    reliable = all(each.qos_profile.reliability == ReliabilityPolicy.RELIABLE for each in publishers)
    latched = latched and publishers and all(each.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in publishers)
    return (ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
            DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE)


class AdaptiveSubscription:
    """Calls take with each message on a topic; made anew where publishers come or go and others fit the policies no longer.

    qos: history and depth; durability transient local, where the last message from before is wanted: of a stream it would be an old one,
    and Fast DDS's system default keeps one too. Its reliability is not looked at. raw: take gets the serialised message.
    """

    def __init__(self, node: Node, kind: type, topic: str, take: Take, qos: QoSProfile, raw: bool = False):
        self._node, self._kind, self._topic, self._take, self._qos, self._raw = node, kind, topic, take, qos, raw
        self._lock = threading.RLock()  # an event comes in the executor's thread, close() in any
        self._subscription: Subscription | None = None
        self._closed = False
        self._subscribe(self._fitting())

    @property
    def policies(self) -> Policies:
        """The present ones."""
        return self._policies

    def close(self) -> None:
        """Take nothing more."""
        with self._lock:
            self._closed = True
            self._unsubscribe()

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
        """The present policies without the one that a publisher does not offer: it may not be in the graph yet."""
        reliability, durability = self._policies
        missing = QoSPolicyKind(info.last_policy_kind)
        return (ReliabilityPolicy.BEST_EFFORT if missing == QoSPolicyKind.RELIABILITY else reliability,
                DurabilityPolicy.VOLATILE if missing == QoSPolicyKind.DURABILITY else durability)

    def _adapt(self, policies: Policies) -> None:
        if policies == self._policies:
            return
        self._take_waiting()  # without the lock: take may wait for one that close() is called under
        with self._lock:
            if not self._closed:
                self._unsubscribe()
                self._subscribe(policies)

    def _taken(self, message, info: dict) -> None:
        self._take(message, received_ns(info))
        self._take_waiting()

    def _take_waiting(self) -> None:
        """Pass on what has come meanwhile."""
        subscription = self._subscription
        if subscription is not None:
            for message, info in waiting(subscription):
                self._take(message, received_ns(info))


def received_ns(info: dict) -> int:
    """When a message was received, ns by this machine's clock; where the middleware does not tell, when it was sent by its sender's."""
    return info['received_timestamp'] or info['source_timestamp']


def waiting(subscription: Subscription) -> Iterator[tuple[object, dict]]:
    """(message, info) of what has come meanwhile, some at once: the executor's way to each costs 0.2 to 0.4 ms, as much as the work on a
    small message. They end where the subscription does."""
    for _ in range(_AT_ONCE):
        try:
            with subscription.handle:
                found = subscription.handle.take_message(subscription.msg_type, subscription.raw)
        except InvalidHandle:
            return
        if found is None:
            return
        yield found
