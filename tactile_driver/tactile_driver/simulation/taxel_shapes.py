# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Faces of objects that press on a taxel pad: where they are, and how high over their foremost part."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..errors import BadArgument

#: Height of the face over its foremost part, m, inf off it, at x, y (m) in the object's frame.
Face = Callable[[np.ndarray, np.ndarray], np.ndarray]


def _flat(inside: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Face:
    return lambda x, y: np.where(inside(x, y), 0.0, np.inf)


def _box(x, y, length: float, width: float):
    return (np.abs(x) <= length / 2) & (np.abs(y) <= width / 2)


FACES: dict[str, Face] = {
    'bar': _flat(lambda x, y: _box(x, y, 0.024, 0.010)),
    'disc': _flat(lambda x, y: np.hypot(x, y) <= 0.010),
    'ring': _flat(lambda x, y: (np.hypot(x, y) <= 0.012) & (np.hypot(x, y) >= 0.006)),
    'l': _flat(lambda x, y: _box(x + 0.006, y, 0.008, 0.024) | _box(x, y + 0.008, 0.020, 0.008)),
    'edge': _flat(lambda x, y: (x >= 0) & (np.abs(x) < 0.1) & (np.abs(y) < 0.1)),
    'sphere': lambda x, y: np.where(np.hypot(x, y) < 0.03, 0.03 - np.sqrt(np.maximum(0.03**2 - x * x - y * y, 0)), np.inf),
    'two_fingers': _flat(lambda x, y: (np.hypot(x - 0.009, y) <= 0.006) | (np.hypot(x + 0.009, y) <= 0.006)),
}


def face_named(name: str) -> Face:
    """The face of that name. Raises BadArgument, listing them, for an unknown one."""
    if name not in FACES:
        raise BadArgument(f'simulation: face {name!r} is unknown; choose one of {", ".join(FACES)}')
    return FACES[name]
