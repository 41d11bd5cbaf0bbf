# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Timers that go on when the clock is set."""
from __future__ import annotations

from collections.abc import Callable

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.timer import Timer


def steady_timer(node: Node, period: float, call: Callable[[], None]) -> Timer:
    """Call once a period, s: also after the wall clock was set back, by which a timer of the node's own clock would stand still for as
    long, and where simulated time does not run."""
    return node.create_timer(period, call, clock=Clock(clock_type=ClockType.STEADY_TIME))
