# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A library of presses as plain whole numbers, as a calibration file keeps it: sixteen bits a value, many values in one number."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..errors import BadCalibration
from .sheet_library import LibraryPlan, ModeClass, SheetLibrary

_EACH = 60  # values of sixteen bits in one number, which stays below the largest floating-point number
_LEVELS = 32000
_PLAN = ('radius', 'depth', 'scale', 'n', 'order', 'levels', 'substeps')


def pack(values: np.ndarray) -> dict:
    """Values of any shape, rounded to 1/32000 of the largest: {'scale': float, 'digits': list of int}."""
    scale = float(np.abs(values).max()) or 1.0
    digits = (np.round(values.ravel() / scale * _LEVELS) + _LEVELS).astype('<u2')
    digits = np.pad(digits, (0, -len(digits) % _EACH)).reshape(-1, _EACH)
    return {'scale': scale, 'digits': [int.from_bytes(row.tobytes(), 'little') for row in digits]}


def unpack(packed: Mapping, shape: tuple) -> np.ndarray:
    """What was packed, in its shape. Raises BadCalibration where there are too few numbers, or others."""
    try:
        raw = b''.join(number.to_bytes(2 * _EACH, 'little') for number in packed['digits'])
        values = np.frombuffer(raw, '<u2').astype(float)[:int(np.prod(shape))] - _LEVELS
        return values.reshape(shape) * (float(packed['scale']) / _LEVELS)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise BadCalibration(f'the presses kept in the calibration file cannot be read ({error}); run calibrate again') from None


def library_numbers(library: SheetLibrary) -> dict:
    """The library as a mapping of plain numbers."""
    classes = [{'odd': list(part.odd), 'modes': len(part.modes), 'shapes': pack(part.modes),
                'coefficients': [pack(part.coefficients[..., k]) for k in range(len(part.modes))]} for part in library.classes]
    return {'half': list(library.plan.half), **{name: getattr(library.plan, name) for name in _PLAN}, 'classes': classes}


def library_from_numbers(numbers: Mapping) -> SheetLibrary:
    """The library of library_numbers. Raises BadCalibration for what is no such mapping."""
    try:
        plan = LibraryPlan(tuple(numbers['half']), **{name: numbers[name] for name in _PLAN})
        classes = [_mode_class(part, plan) for part in numbers['classes']]
    except (KeyError, TypeError) as error:
        raise BadCalibration(f'the presses kept in the calibration file cannot be read ({error}); run calibrate again') from None
    return SheetLibrary(plan, classes)


def _mode_class(part: Mapping, plan: LibraryPlan) -> ModeClass:
    order, levels, count = plan.order, plan.levels + 3, part['modes']
    coefficients = np.stack([unpack(packed, (order, order, 3, levels)) for packed in part['coefficients']], axis=-1)
    return ModeClass(tuple(part['odd']), coefficients, unpack(part['shapes'], (count, plan.n + 1, plan.n + 1, 3)))
