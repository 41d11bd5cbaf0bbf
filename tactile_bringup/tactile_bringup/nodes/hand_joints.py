# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The joints of a hand that a URDF describes: their recent positions, and simulated ones for simulated sensors."""
from __future__ import annotations

import math
from collections import defaultdict, deque
from collections.abc import Mapping

import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import JointState

from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.nodes.runtime.ros_defaults import STREAM_QOS, steady_timer

from ..hand.urdf import Robot
from .constants import BRINGUP

TOPIC = 'joint_states'


class JointPositions:
    """The positions of joints in the last two seconds, from JointState messages that may hold some of the joints each."""

    def __init__(self) -> None:
        self._seen: dict[str, deque[tuple[int, float]]] = defaultdict(deque)

    def add(self, message: JointState) -> None:
        """Keep the finite positions of a message. Stamps that go back, as of a recording played again, restart the history."""
        stamp = stamp_ns_of(message.header)
        for name, position in zip(message.name, message.position):
            if math.isfinite(position):
                seen = self._seen[name]
                if seen and stamp < seen[-1][0]:
                    seen.clear()
                seen.append((stamp, position))
                while stamp - seen[0][0] > BRINGUP.joint_history_ns:
                    seen.popleft()

    def at(self, stamp_ns: int) -> dict[str, float]:
        """Joint -> position at a time, linear between two messages; without the joints of which no message is near that time."""
        found = {}
        for name, seen in self._seen.items():
            stamps = np.array([stamp for stamp, _ in seen], np.int64)
            if np.abs(stamps - stamp_ns).min() <= BRINGUP.max_joint_age_ns:
                found[name] = float(np.interp(stamp_ns - stamps[0], stamps - stamps[0], [position for _, position in seen]))
        return found

    def newest(self) -> dict[str, tuple[int, float]]:
        """Joint -> stamp in ns and position of its last message."""
        return {name: seen[-1] for name, seen in self._seen.items()}


class SimulatedJoints:
    """Moves all joints of a robot between their limits on /joint_states, unless somebody else publishes joint states."""

    def __init__(self, node: Node, robot: Robot):
        self._node, self._limits = node, robot.limits
        self._publisher = node.create_publisher(JointState, TOPIC, STREAM_QOS)
        steady_timer(node, 1.0 / BRINGUP.sweep_rate, self._publish)

    def _publish(self) -> None:
        if self._node.count_publishers(TOPIC) > 1:
            return
        now = self._node.get_clock().now()
        message = JointState(name=list(self._limits), position=self._positions(1e-9 * now.nanoseconds, self._limits))
        message.header.stamp = now.to_msg()
        self._publisher.publish(message)

    @staticmethod
    def _positions(seconds: float, limits: Mapping[str, tuple[float, float]]) -> list[float]:
        share = 0.5 - 0.5 * math.cos(2 * math.pi * seconds / BRINGUP.sweep_s)
        return [low + share * (high - low) for low, high in limits.values()]
