# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A node's health on /diagnostics, and log messages that are not repeated."""
from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import diagnostic_updater
from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.msg import SetParametersResult
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node

from .parameter_server import descriptor_of
from .ros_defaults import steady_timer
from ...errors import BadArgument
from ...parameters.table import Parameter

_CALM_S = 1.0  # chosen
#: of diagnostic_updater, which declares it without a range
_PERIOD = Parameter('diagnostic_updater.period', float, 1.0, 's', 'time between two messages on /diagnostics', 0.01, 3600.0, read_only=True)
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


def remedy_of(health: Health) -> str:
    """The remedy: the part of the message after the problem, or all of it; '' if nothing is wrong."""
    return '' if health.level == OK else health.message.split('; ', 1)[-1]


class NodeDiagnostics:
    """Publishes what examine() returns, once a second and on update(), under the node's full name. hardware_id: of the sensor, such as its
    serial number. Raises BadArgument for a parameter diagnostic_updater.period out of its range."""

    def __init__(self, node: Node, task: str, hardware_id: str, examine: Callable[[], Health]):
        self._updater = _updater(node)
        self._updater.node_name = node.get_fully_qualified_name()  # a hand has several camera_nodes
        self._examine = examine
        self.set_hardware_id(hardware_id)
        self._updater.add(task, self._run)
        node.destroy_timer(self._updater.timer)  # it runs on the node's clock
        self._updater.timer = steady_timer(node, self._updater.period, self._updater.update)

    def set_hardware_id(self, hardware_id: str) -> None:
        """Set the sensor's name; an empty one is published as 'none'."""
        self._updater.setHardwareID(hardware_id or 'none')

    def update(self) -> None:
        """Publish now."""
        self._updater.force_update()

    def _run(self, status: diagnostic_updater.DiagnosticStatusWrapper) -> diagnostic_updater.DiagnosticStatusWrapper:
        health = self._examine()
        status.summary(health.level, health.message)
        for name, value in {**health.values, 'what to do': remedy_of(health)}.items():
            status.add(name, f'{value:.4g}' if isinstance(value, float) else str(value))
        return status


def _updater(node: Node) -> diagnostic_updater.Updater:
    """The updater of a node, whose parameters are checked while it declares them and fixed afterwards."""
    node.add_on_set_parameters_callback(_check_period)
    try:
        updater = diagnostic_updater.Updater(node)
    except (InvalidParameterTypeException, InvalidParameterValueException) as error:
        raise BadArgument(str(error)) from error
    finally:
        node.remove_on_set_parameters_callback(_check_period)
    node.set_descriptor(_PERIOD.name, descriptor_of(_PERIOD))
    return updater


def _check_period(parameters: list) -> SetParametersResult:
    try:
        for parameter in parameters:
            if parameter.name == _PERIOD.name:
                _PERIOD.checked(parameter.value)
    except BadArgument as error:
        return SetParametersResult(successful=False, reason=str(error))
    return SetParametersResult(successful=True)


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

    def forget(self, key: str) -> None:
        """The problem is over: log its next occurrence."""
        self._logged.pop(key, None)

    def settle(self, key: str) -> None:
        """The problem did not occur now: after a second without it, log its next occurrence. A stream in which every other message is bad
        gives one line."""
        if time.monotonic() - self._logged.get(key, math.inf) > _CALM_S:
            self.forget(key)
