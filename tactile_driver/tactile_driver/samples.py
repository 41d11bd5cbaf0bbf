# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Blocks of evenly spaced voltage samples."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

CHANNELS = 4  # x1, y1, x2, y2


@dataclass(frozen=True)
class SampleBlock:
    """Consecutive samples without a gap.

    volts: (N, 4) float32, V, columns x1, y1, x2, y2, NaN where the converter gave no value; stamp_ns: time of the first sample on the
    source's clock, ns; period_s: sampling period, s, NaN for a single sample of unknown rate; truth: of a simulated finger,
    RecordedTruth of a recording that has it, else None.
    """

    volts: np.ndarray
    stamp_ns: int
    period_s: float
    truth: object = None

    @property
    def sizes(self) -> dict:
        """Empty: a block may have any length."""
        return {}
