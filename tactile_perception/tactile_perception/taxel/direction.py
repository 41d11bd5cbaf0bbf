# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A direction known but for half a turn, from frame to frame without jumps."""
from __future__ import annotations

import math


class ContinuousDirection:
    """Angles that go on from the last one; a frame without direction leaves it."""

    def __init__(self):
        self.reset()

    def reset(self) -> None:
        """The next angle is taken as it is."""
        self._last = math.nan

    def process(self, angle: float) -> float:
        """angle, rad, plus the multiple of pi that brings it nearest to the last one; NaN where it is NaN."""
        if not math.isfinite(angle):
            return math.nan
        if math.isfinite(self._last):
            angle += math.pi * round((self._last - angle) / math.pi)
        self._last = angle
        return float(angle)
