# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""State of slip from the object's motion over the pad (src/taxel/tracker.cpp)."""
from __future__ import annotations

import numpy as np

from .._core.taxel import MotionLimits, Sliding
from ..common.estimates import NONE, SlipEstimate, next_state, state_probability
from .constants import TAXEL

#: Constants of motion and slip, with units and meaning in src/taxel/tracker.hpp.
LIMITS = MotionLimits()


class TaxelSlip:
    """State of slip by the share of slipping taxels, with hysteresis.

    calibrated: whether pressure is calibrated.
    """

    def __init__(self, calibrated: bool = True):
        self._precision = (1 - TAXEL.error_rate,) * 3 if calibrated else TAXEL.uncalibrated_precision
        self.reset()

    def reset(self) -> None:
        """Drop all earlier frames."""
        self._state = NONE

    def process(self, sliding: Sliding | None) -> SlipEstimate:
        """Estimate slip in one frame; sliding: None without contact."""
        if sliding is None:
            self.reset()
            return SlipEstimate()
        fraction = sliding.slipping_fraction
        self._state = next_state(self._state, fraction)
        confidence = self._precision[self._state] * state_probability(self._state, fraction, TAXEL.patches)
        if self._state == NONE:
            confidence /= 1 + sliding.unseen  # posterior of even prior odds, given that no slip was observed
            still = np.full(3, np.nan if sliding.unseen == 1 else 0.0)
            return SlipEstimate(NONE, fraction, still, still.copy(), sliding.velocity_covariance, confidence=confidence)
        return SlipEstimate(self._state, fraction, sliding.linear, sliding.angular, sliding.velocity_covariance, sliding.rotation_center,
                            sliding.x, sliding.y, sliding.vx, sliding.vy, confidence)
