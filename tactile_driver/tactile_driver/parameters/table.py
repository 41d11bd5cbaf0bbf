# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A node's parameters in one table: the declaration, the checks, the YAML file and the page in the README come from it. No ROS here."""
from __future__ import annotations

import json
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from ..errors import BadArgument

_KINDS = {bool: 'bool', int: 'int', float: 'float', str: 'string',
          list[int]: 'list of int', list[float]: 'list of float', list[str]: 'list of string'}


@dataclass(frozen=True)
class Parameter:
    """One parameter.

    type: bool, int, float, str, list[int], list[float] or list[str]; lowest, highest: allowed range of a number or of each in a list, in
    unit; choices: allowed values, () for all, or a PluginTable of them;
    read_only: fixed when the node starts. A float may be NaN only where its default is.
    """

    name: str
    type: object
    default: object
    unit: str
    text: str
    lowest: float | None = None
    highest: float | None = None
    choices: Collection = ()
    read_only: bool = False

    def __post_init__(self):
        if self.type not in _KINDS:
            raise BadArgument(f'parameter {self.name}: type {self.type!r} is not one of {", ".join(_KINDS.values())}')
        self.checked(self.default)

    @property
    def kind(self) -> str:
        """The type in words."""
        return _KINDS[self.type]

    @property
    def allowed(self) -> str:
        """Type, range or choices and unit in words, as 'float, 0 to 10 s'."""
        if self.choices:
            own = getattr(self.choices, 'own', self.choices)  # of a PluginTable, to name the others too would delay each node's start
            return f'{self.kind}, one of {", ".join(repr(c) for c in own)}'
        low, high = self.lowest, self.highest
        limits = f'{low:g} to {high:g}' if low is not None and high is not None else f'at least {low:g}' if low is not None \
            else f'at most {high:g}' if high is not None else ''
        return ', '.join(x for x in (self.kind, ' '.join(x for x in (limits, self.unit) if x)) if x)

    def checked(self, value: object) -> object:
        """value in this parameter's type (a whole number will do for a float or a string). Raises BadArgument: name, value, what is
        allowed."""
        converted = _convert(value, self.type)
        entries = converted if isinstance(converted, list) else [converted]
        if converted is None or not all(self._fits(entry) for entry in entries):
            raise BadArgument(f'parameter {self.name} is {value!r}, but must be {self.allowed}')
        return converted

    def _fits(self, value: object) -> bool:
        if self.choices:
            return value in self.choices
        if isinstance(value, float) and math.isnan(value):
            return isinstance(self.default, float) and math.isnan(self.default)
        if isinstance(value, (bool, str)):
            return True
        return math.isfinite(value) and (self.lowest is None or value >= self.lowest) and (self.highest is None or value <= self.highest)


def _convert(value: object, wanted: object) -> object | None:
    """value as the type wanted, None where it is of another. The command line makes whole numbers of '30' and of a serial number of
    digits."""
    if wanted in (list[int], list[float], list[str]):
        entry = wanted.__args__[0]
        if isinstance(value, str) or not hasattr(value, '__iter__'):
            return None
        converted = [_convert(v, entry) for v in value]
        return None if None in converted else converted
    if isinstance(value, bool) or wanted is bool:
        return value if isinstance(value, bool) and wanted is bool else None
    if isinstance(value, int) and wanted in (int, float, str):
        return wanted(value)
    return value if isinstance(value, wanted) else None


def defaults(table: Sequence[Parameter]) -> dict[str, object]:
    """Name -> default value."""
    return {p.name: p.default for p in table}


def _yaml(value: object) -> str:
    if isinstance(value, list):
        return '[' + ', '.join(_yaml(v) for v in value) + ']'
    if isinstance(value, float) and not math.isfinite(value):
        return '.nan' if math.isnan(value) else '.inf' if value > 0 else '-.inf'
    return json.dumps(value)


def to_yaml(table: Sequence[Parameter], node: str) -> str:
    """A parameter file for ROS with all defaults, each explained in a comment; node: its name, as /**/camera_node."""
    lines = [f'{node}:', '  ros__parameters:']
    for p in table:
        lines += [f'    # {p.text} ({p.allowed})', f'    {p.name}: {_yaml(p.default)}']
    return '\n'.join(lines) + '\n'
