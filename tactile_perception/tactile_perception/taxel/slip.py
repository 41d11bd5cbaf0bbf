# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slip of the object over the array, from where and how far it slipped."""
from __future__ import annotations

import numpy as np

from ..contact.slip import NONE, SlipEstimate, next_state
from .array import TaxelArray
from .imprint import Imprint, ImprintMotion

_FAR = 4.0  # a centre of rotation farther than this many radii of the contact is none: the motion is a translation


class TaxelSlip:
    """Slip frame by frame, with the states' hysteresis."""

    def __init__(self, array: TaxelArray):
        self._array = array
        self.reset()

    def reset(self) -> None:
        """Nothing slips."""
        self._state = NONE

    def none(self) -> SlipEstimate:
        """Of a frame in which nothing touches."""
        self._state = NONE
        return SlipEstimate()

    def process(self, motion: ImprintMotion, imprint: Imprint, touched: np.ndarray) -> SlipEstimate:
        """Slip in a frame with motion, where taxels touched (rows, columns) bool carry the object."""
        slipping = imprint.slips(motion.slipped) & touched
        fraction = float(slipping.sum() / touched.sum())
        self._state = next_state(self._state, fraction)
        if self._state == NONE:
            slipping = np.zeros_like(slipping)
        row, column = np.nonzero(slipping)
        x, y = self._array.x[column], self._array.y[row]
        estimate = SlipEstimate(self._state, fraction, x=x, y=y)
        estimate.linear, estimate.angular = np.zeros(3), np.zeros(3)
        if self._state == NONE:
            return estimate
        turn = np.nan_to_num(motion.turn)
        estimate.vx, estimate.vy = motion.linear[0] - turn * y, motion.linear[1] + turn * x
        estimate.linear[:2], estimate.angular[2] = motion.linear, motion.turn
        estimate.linear[2] = estimate.angular[0] = estimate.angular[1] = 0.0
        centre = self._centre(motion.linear, motion.turn, touched)
        estimate.rotation_center = np.array([*centre, 0.0]) if np.isfinite(centre).all() else np.full(3, np.nan)
        return estimate

    def _centre(self, linear: np.ndarray, turn: float, touched: np.ndarray) -> np.ndarray:
        """(2,) m: where the object stands still; NaN for a translation, or where a turn cannot be seen."""
        if not np.isfinite(turn) or not turn:
            return np.full(2, np.nan)
        row, column = np.nonzero(touched)
        middle = np.array([self._array.x[column].mean(), self._array.y[row].mean()])
        centre = np.array([-linear[1], linear[0]]) / turn
        radius = np.sqrt(len(row) / np.pi) * self._array.pitch
        return centre if np.hypot(*(centre - middle)) < _FAR * radius else np.full(2, np.nan)
