# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Checks that recorded presses determine the calibration of a sheet or a dome, and the residuals at held-out presses."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..calibration.residuals import Residuals
from ..errors import BadCalibration
from .cross_validation import HeldOut
from .presses import Presses

_FEWEST_PLACES = 3  # chosen: cross-validation holds out one of three positions
_DEPTH_SPAN = 0.2  # chosen: smallest range of depths over the largest depth
_AXES = ('x (mm)', 'y (mm)')


def require_coverage(presses: Presses) -> None:
    """Raise BadCalibration, saying what to add, for too few positions, a single depth, or no untouched frame."""
    touching = presses.touching
    places, depth = int(presses.places().max() + 1), presses.depth[touching]
    if places < _FEWEST_PLACES:
        raise BadCalibration(f'{touching.sum()} presses at {places} positions; at least {_FEWEST_PLACES} are needed, a dozen over the '
                             'whole surface are good: add presses at other positions')
    if np.ptp(depth) < _DEPTH_SPAN * depth.max():
        raise BadCalibration(f'all presses are {depth.min() * 1e3:.2f} to {depth.max() * 1e3:.2f} mm deep: one depth does not determine '
                             'how markers move with depth; add presses of other depths, three per position are good')
    if touching.all():
        raise BadCalibration('no untouched frame among the presses; begin each recording with one second without contact')


def marker_residuals(held: HeldOut, names: Sequence[str]) -> list[Residuals]:
    """Cross-validation errors of position and depth, mm, over the surface; NaN for a press without an estimate.

    names: recording and time of each press of the calibration.
    """
    touching = np.flatnonzero(held.presses.touching)
    off, deep = np.full(len(touching), np.nan), np.full(len(touching), np.nan)
    for row, k in enumerate(touching):
        position, depth = held.presses.position[k], held.presses.depth[k]
        touches = held.found[k]
        if touches:
            nearest = min(touches, key=lambda touch: np.hypot(*(touch.position - position)[:2]))
            off[row], deep[row] = np.hypot(*(nearest.position - position)[:2]), nearest.depth - depth
    places = 1e3 * held.presses.position[touching, :2]
    when = [names[held.number[k]] for k in touching]
    return [Residuals('place', 'mm', 1e3 * off, places, _AXES, when), Residuals('depth', 'mm', 1e3 * deep, places, _AXES, when)]
