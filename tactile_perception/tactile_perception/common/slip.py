# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slip state from the slipping fraction, and planar twist of a motion."""
from __future__ import annotations

import numpy as np

from .. import _core
from .estimates import GROSS, INCIPIENT, NONE

# Slipping fractions at which a state begins, and below which it ends (hysteresis against single dots). Chosen.
_INCIPIENT = (0.05, 0.03)
STILL_GROSS = 0.85
_GROSS = (0.90, STILL_GROSS)
_FAR = 4.0  # radii of the contact: a centre of rotation farther away counts as a translation. Chosen


def next_state(state: int, fraction: float) -> int:
    """State from the slipping fraction, with hysteresis."""
    if fraction >= _GROSS[state == GROSS]:
        return GROSS
    return INCIPIENT if fraction >= _INCIPIENT[state != NONE] else NONE


def planar_twist(place: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
    """Velocity (2,) at the origin, angular velocity, and centre of rotation (2,), NaN for a translation, from velocity (S, 2) at place
    (S, 2); all NaN for coincident or NaN places. Kernel: src/common/planar_twist.cpp."""
    return _core.planar_twist(np.asarray(place, float), np.asarray(velocity, float), far=_FAR)
