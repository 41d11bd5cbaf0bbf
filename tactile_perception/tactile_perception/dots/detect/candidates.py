# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Candidate dots: peaks of a reduced image above its local background. The search prefers false candidates to missed dots; the fit
rejects false ones."""
from __future__ import annotations

import numpy as np

from tactile_perception._core import find_peaks

_SMALLEST_HALVED = 5.0  # px: smaller typical diameters are searched at full resolution. Chosen
_WEAKEST = 0.14  # smallest peak as a share of the dots' contrast. Chosen: admits a small dot in a third of the light
_NOISE_PEAK = 2.0  # smallest peak in standard deviations of a pixel of the reduced image. Chosen


def find_candidates(grey: np.ndarray, look) -> np.ndarray:
    """(N, 2) px, candidate positions in this image, accurate to about half a pixel; grey: (H, W) uint8; look: appearance.Look."""
    step = 2 if look.typical >= _SMALLEST_HALVED else 1
    smooth = 2 * int(min(max(look.typical / step / 2.5, 1), 5)) + 1
    box = 2 * int(1.1 * look.typical / step) + 3
    lowest = max(_WEAKEST * abs(look.contrast), _NOISE_PEAK * look.noise / step, 2.0)
    return find_peaks(grey, step=step, smooth=smooth, box=box, sign=1 if look.contrast > 0 else -1, lowest=lowest)
