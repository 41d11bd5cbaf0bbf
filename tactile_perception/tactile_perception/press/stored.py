# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fitted dataclasses as numbers, arrays and dictionaries of them, for a calibration file."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from ..errors import BadArgument, BadCalibration

Kind = TypeVar('Kind')


def stored(value):
    """A dataclass, by the names of its fields; what it holds, likewise."""
    if is_dataclass(value):
        return {part.name: stored(getattr(value, part.name)) for part in fields(value)}
    return [stored(part) for part in value] if isinstance(value, (list, tuple)) else value


def restored(kind: type[Kind], numbers: Mapping) -> Kind:
    """Inverse of stored, for a dataclass. Raises BadCalibration where something is missing or invalid."""
    try:
        return _restored(kind, numbers)
    except (KeyError, TypeError, ValueError, AttributeError, BadArgument) as wrong:
        raise BadCalibration(f'{kind.__name__} in the calibration file cannot be read ({wrong!r}); run calibrate again') from wrong


def _restored(kind, value):
    origin = get_origin(kind)
    if origin in (list, tuple):
        return origin(_restored(get_args(kind)[0], part) for part in value)
    if is_dataclass(kind):
        hints = get_type_hints(kind)
        return kind(**{part.name: _restored(hints[part.name], value[part.name]) for part in fields(kind)})
    if kind is np.ndarray:
        array = np.asarray(value)
        return array if array.dtype == np.float32 else array.astype(float)
    return kind(value)
