# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A topic of a hand that is computed from topics of its sensors while somebody wants it."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile

from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.ros_defaults import STREAM_QOS

from ..hand.description import Hand, HandSensor
from .hand_joints import JointPositions


class HandPublisher:
    """Subscribes to topics of all sensors of a hand while its own topic has a subscriber, or always. Subclasses define `_take`.

    Parameters
    ----------
    node, host : Node, Host
        Where it runs.
    hand : Hand
        The sensors and where they are.
    positions : JointPositions
        Of the joints that move sensors.
    always : bool
        Whether it needs no subscriber.
    """

    kind: type
    topic: str
    inputs: Mapping[str, type]  # topic in the namespace of a sensor -> type
    depth: int  # of their queues

    def __init__(self, node: Node, host: Host, hand: Hand, positions: JointPositions, always: bool = False):
        self._node, self._host, self._hand, self._positions, self._always = node, host, hand, positions, always
        self._ends: list[Callable[[], None]] = []
        self._publisher = node.create_publisher(
            self.kind, self.topic, STREAM_QOS, event_callbacks=PublisherEventCallbacks(matched=lambda _info: self._follow_demand()))
        self._follow_demand()

    def _follow_demand(self) -> None:
        wanted = self._always or self._publisher.get_subscription_count() > 0
        if wanted and not self._ends:
            self._begin()
            self._ends = [self._host.listen(self._node, kind, f'/{sensor.name}/{topic}', partial(self._take, sensor),
                                            QoSProfile(depth=self.depth))
                          for sensor in self._hand.sensors for topic, kind in self.inputs.items()]
        elif not wanted and self._ends:
            for end in self._ends:
                end()
            self._ends = []
            self._end()

    def _begin(self) -> None:
        """Do what is needed before the first message."""

    def _end(self) -> None:
        """Drop all messages."""

    def _take(self, sensor: HandSensor, message, _received_ns: int) -> None:
        raise NotImplementedError
