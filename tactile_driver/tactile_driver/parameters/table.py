# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tables of parameters: a node's declaration, its checks and its YAML file come from one table. This module imports no ROS."""
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
    """One parameter of a node.

    Parameters
    ----------
    name : str
        Name of the ROS parameter.
    type : type
        ``bool``, ``int``, ``float``, ``str``, ``list[int]``, ``list[float]`` or ``list[str]``.
    default : object
        Default value. Only a float whose default is NaN may be NaN.
    unit : str
        Unit of the value; empty if it has none.
    text : str
        Description, shown by ``ros2 param describe`` and in parameter files.
    lowest, highest : float, optional
        Allowed range of a number, or of each number of a list, in `unit`.
    choices : collection
        Allowed values; empty if every value is allowed.
    read_only : bool
        Whether the value is fixed once the node has started.

    Raises
    ------
    BadArgument
        If the type is not supported, or the default is not allowed.

    Examples
    --------
    >>> rate = Parameter('rate', float, 30.0, 'Hz', 'frame rate', 0.0, 500.0)
    >>> rate.allowed
    'float, 0 to 500 Hz'
    >>> rate.checked(15)
    15.0
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
        """Name of the type, as messages show it."""
        return _KINDS[self.type]

    @property
    def allowed(self) -> str:
        """Type, range or choices, and unit as text, such as ``float, 0 to 10 s``."""
        if self.choices:
            # Only the own entries of a PluginTable: looking up those of other packages would delay the start of each node.
            own = getattr(self.choices, 'own', self.choices)
            return f'{self.kind}, one of {", ".join(repr(c) for c in own)}'
        low, high = self.lowest, self.highest
        limits = f'{low:g} to {high:g}' if low is not None and high is not None else f'at least {low:g}' if low is not None \
            else f'at most {high:g}' if high is not None else ''
        return ', '.join(x for x in (self.kind, ' '.join(x for x in (limits, self.unit) if x)) if x)

    def checked(self, value: object) -> object:
        """Convert a value to the type of this parameter and check it.

        Parameters
        ----------
        value : object
            The value. An integer is accepted for a float or a string.

        Returns
        -------
        object
            The converted value.

        Raises
        ------
        BadArgument
            If the value is not allowed; the message names the parameter, the value and what is allowed.
        """
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
    """Convert a value to a type; None if that is not possible.

    The ROS command line turns ``30``, and a serial number of digits, into integers.
    """
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
    """Default value of each parameter, by name.

    Parameters
    ----------
    table : sequence of Parameter
        The parameters of one node.

    Returns
    -------
    dict
        Name to default value.

    Examples
    --------
    >>> defaults([Parameter('rate', float, 30.0, 'Hz', 'frame rate')])
    {'rate': 30.0}
    """
    return {p.name: p.default for p in table}


def _yaml(value: object) -> str:
    if isinstance(value, list):
        return '[' + ', '.join(_yaml(v) for v in value) + ']'
    if isinstance(value, float) and not math.isfinite(value):
        return '.nan' if math.isnan(value) else '.inf' if value > 0 else '-.inf'
    return json.dumps(value)


def to_yaml(table: Sequence[Parameter], node: str) -> str:
    """Text of a ROS parameter file with all defaults.

    Parameters
    ----------
    table : sequence of Parameter
        The parameters of one node.
    node : str
        Name of the node in the file, such as ``/**/camera_node``.

    Returns
    -------
    str
        YAML text with a comment on each parameter: its description and its allowed values.
    """
    lines = [f'{node}:', '  ros__parameters:']
    for p in table:
        lines += [f'    # {p.text} ({p.allowed})', f'    {p.name}: {_yaml(p.default)}']
    return '\n'.join(lines) + '\n'
