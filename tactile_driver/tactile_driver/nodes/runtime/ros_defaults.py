# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What all nodes choose alike where ROS 2 leaves it open: the QoS of publishers and the clock of timers."""
from __future__ import annotations

from collections.abc import Callable

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.timer import Timer

#: QoS of image, result and marker publishers. Volatile is explicit: Fast DDS makes the system default transient local, so that a played bag
#: would latch old results. The depth is Fast DDS's default: the newest message replaces one that a slow subscriber has not acknowledged.
STREAM_QOS = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.RELIABLE,
                        durability=DurabilityPolicy.VOLATILE)
#: QoS of camera_info and description: a subscriber that joins later gets the last message.
LATCHED_QOS = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.RELIABLE,
                         durability=DurabilityPolicy.TRANSIENT_LOCAL)
#: s that a first image waits for a camera_info that is published; discovery by Fast DDS can take seconds.
CAMERA_INFO_PATIENCE_S = 5.0


def steady_timer(node: Node, period: float, call: Callable[[], None]) -> Timer:
    """Call once a period, s, on the monotonic clock: setting the wall clock back or a stopped simulated time does not stop it."""
    return node.create_timer(period, call, clock=Clock(clock_type=ClockType.STEADY_TIME))
