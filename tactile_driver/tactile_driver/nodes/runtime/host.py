# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The process that a node runs in, with other nodes or alone, and subscriptions that adopt what their publishers offer."""
from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

from rclpy.duration import Duration
from rclpy.event_handler import QoSRequestedIncompatibleQoSInfo, SubscriptionEventCallbacks
from rclpy.exceptions import InvalidHandle
from rclpy.lifecycle import LifecyclePublisher
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

from ...recordings.written_message import WrittenMessage
from ...sources.source import NS
from ..messages.images import message_type

Take = Callable[[object, int], None]  # a message, and its time of receipt, ns

_NOT_NUMBERED = 2**64 - 1  # RMW_MESSAGE_INFO_SEQUENCE_NUMBER_UNSUPPORTED of rmw

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

    Messages that wait while it subscribes again are lost.

    kind: type of the messages; of a topic that is or is remapped to .../compressed, Image stands for CompressedImage.
    qos: history and depth; durability: transient local to also receive the last message published before (of a stream that would be an old
    one). Its reliability is ignored. begin: called before the first message is taken, with the number of messages that its publisher
    sent before it.
    """

    _raw = False

    def __init__(self, node: Node, kind: type, topic: str, take: Take, qos: QoSProfile,
                 begin: Callable[[int], None] = lambda _missed: None):
        self._begin: Callable[[int], None] | None = begin
        self._node, self._topic, self._take, self._qos = node, topic, take, qos
        self._kind = message_type(kind, node.resolve_topic_name(topic))
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
        with self._lock:
            if not self._closed:
                self._unsubscribe()
                self._subscribe(policies)

    def _taken(self, message, info: dict) -> None:
        if self._closed:
            return
        if self._begin is not None:
            self._begin(_sent_before(info))
            self._begin = None
        self._take(message, received_ns(info))


class SerializedSubscription(AdaptiveSubscription):
    """The same, whose take gets the serialised message."""

    _raw = True


def _sent_before(info: dict) -> int:
    """Number of messages that the publisher sent before this one; 0 where the middleware does not number them."""
    number = info.get('publication_sequence_number') or 1
    return number - 1 if number < _NOT_NUMBERED else 0


def received_ns(info: dict) -> int:
    """Time of receipt, ns of this machine's clock; the sending time by the sender's clock if the middleware gives none."""
    return info['received_timestamp'] or info['source_timestamp']


class SharedPublisher:
    """A publisher with local subscribers ("takers"): functions in its process, called with each message in the publishing thread. The
    middleware gets the message if it has subscribers too. changed: called when takers are added or removed."""

    def __init__(self, publisher: Publisher, changed: Callable[[], None]):
        self._publisher, self._changed = publisher, changed
        self.takers: tuple[Take, ...] = ()

    def attach(self, take: Take) -> Callable[[], None]:
        """Call take with each message from now on; returns a function that ends it."""
        self._set((*self.takers, take))
        return lambda: self._set(tuple(other for other in self.takers if other is not take))

    def _set(self, takers: tuple[Take, ...]) -> None:
        self.takers = takers
        self._changed()

    def get_subscription_count(self) -> int:
        """Number of local and middleware subscribers."""
        return len(self.takers) + self._publisher.get_subscription_count()

    def publish(self, message, waited_s: float = 0.0) -> None:
        """Publish to the middleware first, then to the takers, with a sending time waited_s, s, before now. The middleware gets the bytes
        of a WrittenMessage, takers its message. An inactive lifecycle publisher publishes nothing."""
        if isinstance(self._publisher, LifecyclePublisher) and not self._publisher.is_activated:
            return
        written = isinstance(message, WrittenMessage)
        if self._publisher.get_subscription_count():
            self._publisher.publish(message.cdr if written else message)
        for take in self.takers:
            take(message.message if written else message, time.time_ns() - round(waited_s * NS))

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

    def publisher(self, publisher: Publisher, changed: Callable[[], None] = lambda: None) -> SharedPublisher:
        """The publisher, shared within the process if the host shares; changed: called when takers are added or removed."""
        made = SharedPublisher(publisher, changed)
        if self._shared is not None:
            self._shared[publisher.topic_name] = made
        return made

    def has_takers(self, node: Node, topic: str) -> bool:
        """Whether the topic has local subscribers, which the middleware does not report."""
        own = self._own(node, topic)
        return own is not None and bool(own.takers)

    def _own(self, node: Node, topic: str) -> SharedPublisher | None:
        return (self._shared or {}).get(node.resolve_topic_name(topic))

    @property
    def shares(self) -> bool:
        """Whether other nodes are in the process."""
        return self._shared is not None

    @property
    def publishers(self) -> tuple[SharedPublisher, ...]:
        """The publishers that the nodes of this process share; none where nothing is shared."""
        return tuple((self._shared or {}).values())

    def publishes(self, node: Node, topic: str) -> bool:
        """Whether a node of this process publishes a topic to the others by calls, in which nothing is lost."""
        return self._own(node, topic) is not None

    def listen(self, node: Node, kind: type, topic: str, take: Take, qos: QoSProfile,
               begin: Callable[[int], None] = lambda _missed: None) -> Callable[[], None]:
        """Call take with each message on a topic: by the publisher in this process if there is one, else by an AdaptiveSubscription (which
        see for qos and begin). Returns a function that ends it."""
        own = self._own(node, topic)
        return own.attach(take) if own is not None else AdaptiveSubscription(node, kind, topic, take, qos, begin=begin).close
