# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""When the second of two cameras exposes: soon after a trigger, or running free."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_MOST = 0.45  # largest offset, in frame periods; chosen: below one half, so that exposures of the same number are the nearest ones


@dataclass(frozen=True)
class Shutters:
    """Exposures of the right camera relative to those of the left one.

    offset: s, mean delay of the right camera; swing: s, amplitude of the slow drift of this delay, one period per scene; jitter: s,
    standard deviation of single exposures; seed: of the jitter. The delay is limited to _MOST of a frame period.
    """

    offset: float = 0.0
    swing: float = 0.0
    jitter: float = 0.0
    seed: int = 0

    def delays(self, frames: int, rate: float) -> np.ndarray:
        """(frames,) s: delay of the right exposure of each frame of a scene at rate frames/s; negative where it is the earlier one."""
        drift = self.offset + self.swing * np.sin(2 * np.pi * np.arange(frames) / frames)
        return np.clip(drift + np.random.default_rng([self.seed, 5]).normal(0, self.jitter, frames), -_MOST / rate, _MOST / rate)
