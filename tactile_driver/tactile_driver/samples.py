# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Blocks of evenly spaced samples in volts."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

CHANNELS = 4  # x1, y1, x2, y2


@dataclass(frozen=True)
class SampleBlock:
    """Samples that follow each other without a gap.

    volts: (N, 4) float32, x1, y1, x2, y2, NaN where the converter gave none; stamp_ns: sampling of the first one on the clock that the
    source was given, ns; period_s: between two samples, NaN for a single one of unknown rate; truth: truth of a simulated sensor, else
    None.
    """

    volts: np.ndarray
    stamp_ns: int
    period_s: float
    truth: object = None

    @property
    def sizes(self) -> dict:
        """None: blocks may be of any length."""
        return {}
