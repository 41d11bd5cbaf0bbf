# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The published method (Maekawa et al., section 5, eqs 1 to 8): an offset stored once and a fixed threshold."""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from .ambient_light import Light, LightState
from ..errors import BadArgument
from .finger import FingerSettings, PsdFinger
from .model import FingerModel


class FixedThreshold:
    """Contact where the total exceeds threshold, V (section 5). No other sample is settled, so the offset stays."""

    def __init__(self, threshold: float):
        if not threshold > 0:
            raise BadArgument(f'paper.threshold is {threshold} V; it must be positive')
        self._threshold = threshold
        self.begin()

    def begin(self) -> None:
        """Nothing touches."""
        self.touching = False

    def interrupt(self) -> None:
        """Nothing depends on earlier samples."""

    def process(self, light: Light, sigma: float, period_s: float) -> tuple[np.ndarray, LightState]:
        """See ContactDetector.process."""
        contact = light.total > self._threshold
        self.touching = bool(contact[-1])
        return contact, LightState(contact, contact, False)


class PaperFinger(PsdFinger):
    """PsdFinger with the paper's map and threshold, V. Raises BadArgument for a threshold that is not positive."""

    holds_light = False

    def __init__(self, model: FingerModel, settings: FingerSettings, threshold: float):
        super().__init__(replace(model, smooth=None, level=None, cross=None, creep=None), settings, FixedThreshold(threshold))
