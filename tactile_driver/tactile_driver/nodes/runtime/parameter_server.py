# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A parameter table on a node: declared with descriptors, checked before a change, applied after it."""
from __future__ import annotations

from collections.abc import Callable, Sequence

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import InvalidParameterValueException
from rclpy.node import Node

from ...errors import TactileError
from ...parameters.table import Parameter


def descriptor_of(parameter: Parameter) -> ParameterDescriptor:
    """The descriptor that `ros2 param describe` shows and rclpy checks."""
    # Dynamic typing accepts `rate:=30` for a float; Parameter.checked checks the type.
    about = ParameterDescriptor(name=parameter.name, description=parameter.text, additional_constraints=parameter.allowed,
                                read_only=parameter.read_only, dynamic_typing=True)
    if parameter.lowest is not None and parameter.highest is not None:
        if parameter.type is float:
            about.floating_point_range = [FloatingPointRange(from_value=float(parameter.lowest), to_value=float(parameter.highest))]
        if parameter.type is int:
            about.integer_range = [IntegerRange(from_value=int(parameter.lowest), to_value=int(parameter.highest))]
    return about


class NodeParameters:
    """The values of a table's parameters on a node; read them as parameters['rate'] or all at once as values().

    check: called with name -> new value before a change; raises a TactileError to refuse it, without side effects. apply: called with the
    same after the change. A wrong start value leaves the default and is listed in problems (name -> message) until it is corrected.
    """

    def __init__(self, node: Node, table: Sequence[Parameter], check: Callable[[dict], None] | None = None,
                 apply: Callable[[dict], None] | None = None):
        self.problems: dict[str, str] = {}
        self._table = {p.name: p for p in table}
        self._values = {p.name: p.default for p in table}
        self._check, self._apply, self._reason = None, None, ''
        node.add_on_set_parameters_callback(self._on_set)
        node.add_post_set_parameters_callback(self._on_post_set)
        for parameter in table:
            self._declare(node, parameter)
        self._check, self._apply = check, apply

    def __getitem__(self, name: str) -> object:
        return self._values[name]

    def values(self) -> dict[str, object]:
        """Name -> value, a copy."""
        return dict(self._values)

    def _declare(self, node: Node, parameter: Parameter) -> None:
        # The range is added afterwards: rclpy's own refusal names neither type nor unit.
        free = ParameterDescriptor(dynamic_typing=True)
        try:
            node.declare_parameter(parameter.name, parameter.default, free)
        except InvalidParameterValueException:
            node.declare_parameter(parameter.name, parameter.default, free, ignore_override=True)
            self.problems[parameter.name] = self._reason
        node.set_descriptor(parameter.name, descriptor_of(parameter))

    def _changes(self, parameters: list) -> dict[str, object]:
        return {p.name: self._table[p.name].checked(p.value) for p in parameters if p.name in self._table}

    def _on_set(self, parameters: list) -> SetParametersResult:
        try:
            changes = self._changes(parameters)
            if self._check is not None and changes:
                self._check(changes)
        except TactileError as error:
            self._reason = str(error)
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _on_post_set(self, parameters: list) -> None:
        changes = self._changes(parameters)
        self._values.update(changes)
        for name in changes:
            self.problems.pop(name, None)
        if self._apply is not None and changes:
            self._apply(changes)
