# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A node's health on /diagnostics, and log messages that are not repeated."""
from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from std_msgs.msg import Header

from ..constants import NODES
from .ros_defaults import steady_timer

OK, WARN, ERROR, STALE = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR, DiagnosticStatus.STALE


@dataclass(frozen=True)
class Health:
    """level: OK, WARN, ERROR or STALE; message: the state, or 'problem; remedy'; values: name with unit -> number or text."""

    level: bytes
    message: str
    values: dict = field(default_factory=dict)


def common_values(state: str, rate: float = math.nan, age: float = math.nan, dropped: int = 0) -> dict:
    """The values that every node reports under the same names. rate: of publishing, Hz; age: of the newest message, s; dropped: number of
    messages received but not processed. NodeDiagnostics adds the last one, 'what to do'."""
    return {'state': state, 'rate (Hz)': rate, 'age (s)': age, 'dropped': dropped}


class NodeDiagnostics:
    """Publishes what examine() returns, every period_s seconds and on update(), under the node's full name: a hand has several
    camera_nodes. hardware_id: of the sensor, such as its serial number; an empty one is published as 'none'."""

    period_s = 1.0

    def __init__(self, node: Node, task: str, hardware_id: str, examine: Callable[[], Health]):
        self.hardware_id = hardware_id
        self._node, self._task, self._examine = node, task, examine
        self._output = node.create_publisher(DiagnosticArray, '/diagnostics', 1)
        steady_timer(node, self.period_s, self.update)

    def update(self) -> None:
        """Publish now."""
        health = self._examine()
        shown = {name: f'{value:.4g}' if isinstance(value, float) else str(value) for name, value in health.values.items()}
        shown['what to do'] = '' if health.level == OK else health.message.split('; ', 1)[-1]
        values = [KeyValue(key=name, value=text) for name, text in shown.items()]
        status = DiagnosticStatus(level=health.level, name=f'{self._node.get_fully_qualified_name()}: {self._task}', message=health.message,
                                  hardware_id=self.hardware_id or 'none', values=values)
        self._output.publish(DiagnosticArray(header=Header(stamp=self._node.get_clock().now().to_msg()), status=[status]))


class LogOnce:
    """Logs a message once, and not again until it is forgotten: a broken stream must not flood the log."""

    def __init__(self, node: Node):
        self._logger = node.get_logger()
        self._logged: dict[str, float] = {}  # key -> last occurrence, monotonic s

    def error(self, key: str, text: str) -> None:
        """Log text as an error, once for each key."""
        if self._is_new(key):
            self._logger.error(text)

    def warning(self, key: str, text: str) -> None:
        """Log text as a warning, once for each key."""
        if self._is_new(key):
            self._logger.warning(text)

    def _is_new(self, key: str) -> bool:
        known = key in self._logged
        self._logged[key] = time.monotonic()
        return not known

    def reset(self, key: str) -> None:
        """The problem is over: log its next occurrence."""
        self._logged.pop(key, None)

    def settle(self, key: str) -> None:
        """The problem did not occur now: after a second without it, log its next occurrence. A stream in which every other message is bad
        gives one line."""
        if time.monotonic() - self._logged.get(key, math.inf) > NODES.calm_s:
            self.reset(key)
