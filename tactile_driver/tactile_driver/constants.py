# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fields of the frozen dataclasses that hold the constants of a part of the software; docs/constants.md is printed from them."""
from dataclasses import field

ORIGINS = ('measured', 'physical', 'prior', 'limit', 'numeric')


def constant(value, unit: str, origin: str, meaning: str):
    """Make a dataclass field.

    unit: '1' for a ratio or a number; origin: one of ORIGINS, that is, a measured noise or error, a physical property, a prior, a limit of
    the sensor or of a method, or the resolution or tolerance of a computation; meaning: what it is, and why it has this value.
    """
    if origin not in ORIGINS:
        raise ValueError(f'origin {origin!r} of a constant; known: {", ".join(ORIGINS)}')
    return field(default=value, metadata={'unit': unit, 'origin': origin, 'meaning': meaning})
