# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slip of the object over the pad from its motion (src/taxel/tracker.cpp)."""
from __future__ import annotations

import math

import numpy as np

from .._core.taxel import MotionLimits, ObjectMotion
from ..common.constants import COMMON
from ..common.estimates import NONE, SlipEstimate, next_state, planar_covariance, state_probability
from .constants import TAXEL
from .pressure import TaxelArray

#: Constants of motion and slip, with units and meaning in src/taxel/tracker.hpp.
LIMITS = MotionLimits()


class TaxelSlip:
    """Slip of the object from its motion and the slipping taxels, with hysteresis of the state.

    calibrated: whether pressure is calibrated.
    """

    def __init__(self, array: TaxelArray, calibrated: bool = True):
        self._array, self._precision = array, (1 - TAXEL.error_rate,) * 3 if calibrated else TAXEL.uncalibrated_precision
        self.reset()

    def reset(self) -> None:
        """Drop all earlier frames."""
        self._state = NONE

    def process(self, motion: ObjectMotion, touched: np.ndarray) -> SlipEstimate:
        """Estimate slip in one frame; touched: (rows, columns) bool, taxels in contact, at least one."""
        slipping = motion.slipping
        fraction = np.count_nonzero(slipping) / np.count_nonzero(touched)
        self._state = next_state(self._state, fraction)
        estimate = SlipEstimate(self._state, fraction, np.zeros(3), np.zeros(3), planar_covariance(motion.velocity_covariance))
        estimate.confidence = self._precision[self._state] * state_probability(self._state, fraction, TAXEL.patches)
        if self._state == NONE:
            estimate.confidence /= 1 + motion.unseen  # posterior of even prior odds, given that no slip was observed
            if motion.unseen == 1:
                estimate.linear, estimate.angular = np.full(3, np.nan), np.full(3, np.nan)
            return estimate
        x, y = estimate.x, estimate.y = self._positions(slipping)
        turn = 0.0 if math.isnan(motion.turn) else motion.turn
        along_x, along_y = motion.linear.tolist()
        estimate.vx, estimate.vy = along_x - turn * y, along_y + turn * x
        estimate.linear, estimate.angular = np.array([along_x, along_y, 0.0]), np.array([0.0, 0.0, motion.turn])
        if turn:  # otherwise a translation, or the rotation is unobservable
            centre = -along_y / turn, along_x / turn
            x, y = self._positions(touched)
            if math.dist(centre, (x.mean(), y.mean())) < COMMON.max_centre_distance * math.sqrt(len(x) / math.pi) * self._array.pitch:
                estimate.rotation_center = np.array([*centre, 0.0])
        return estimate

    def _positions(self, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates x and y (M,), m, of the taxels in mask (rows, columns) bool."""
        row, column = np.divmod(np.flatnonzero(mask), self._array.columns)  # takes half the time of np.nonzero
        return self._array.x[column], self._array.y[row]
