# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slip of the object over the array from its motion and the slipping taxels."""
from __future__ import annotations

import math

import numpy as np

from .array import TaxelArray
from ..common.estimates import NONE, SlipEstimate, next_state
from .imprint import ImprintMotion

_FAR = 4.0  # radii of the contact within which a centre of rotation is reported; farther ones are translations. Chosen


class TaxelSlip:
    """Slip frame by frame, with hysteresis of the state."""

    def __init__(self, array: TaxelArray):
        self._array = array
        self.reset()

    def reset(self) -> None:
        """Forget; nothing slips."""
        self._state = NONE

    def none(self) -> SlipEstimate:
        """The estimate of a frame without contact."""
        self._state = NONE
        return SlipEstimate()

    def process(self, motion: ImprintMotion, touched: np.ndarray) -> SlipEstimate:
        """Slip in a frame; touched: (rows, columns) bool, taxels in contact, at least one."""
        fraction = np.count_nonzero(motion.slipping) / np.count_nonzero(touched)
        self._state = next_state(self._state, fraction)
        estimate = SlipEstimate(self._state, fraction, np.zeros(3), np.zeros(3))
        if self._state == NONE:
            return estimate
        x, y = estimate.x, estimate.y = self._places(motion.slipping)
        turn = 0.0 if math.isnan(motion.turn) else motion.turn
        along_x, along_y = motion.linear.tolist()
        estimate.vx, estimate.vy = along_x - turn * y, along_y + turn * x
        estimate.linear, estimate.angular = np.array([along_x, along_y, 0.0]), np.array([0.0, 0.0, motion.turn])
        centre = self._centre(along_x, along_y, motion.turn, touched)
        if centre is not None:
            estimate.rotation_center = np.array([*centre, 0.0])
        return estimate

    def _centre(self, along_x: float, along_y: float, turn: float, touched: np.ndarray) -> tuple[float, float] | None:
        """Instantaneous centre of rotation (x, y), m; None for a translation or where rotation is unobservable."""
        if not math.isfinite(turn) or not turn:
            return None
        centre = -along_y / turn, along_x / turn
        x, y = self._places(touched)
        radius = math.sqrt(len(x) / math.pi) * self._array.pitch
        return centre if math.dist(centre, (float(x.mean()), float(y.mean()))) < _FAR * radius else None

    def _places(self, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """x and y (M,) m of the taxels in mask (rows, columns) bool."""
        row, column = np.divmod(np.flatnonzero(mask), self._array.columns)  # half of the time of np.nonzero
        return self._array.x[column], self._array.y[row]
