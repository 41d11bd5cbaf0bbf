# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where dots may be: peaks of a small image against its local ground. Too many rather than too few; the fit decides."""
from __future__ import annotations

import numpy as np

from tactile_perception._core import find_peaks

_SMALLEST_HALVED = 5.0  # px: dots typically smaller than this are looked for in the full image
_WEAKEST = 0.14  # peak against ground, of the dots' contrast: a small dot where the light is a third
_NOISE_PEAK = 2.0  # standard deviations of a pixel of the small image that smoothing still lets through


def find_candidates(grey: np.ndarray, look) -> np.ndarray:
    """(N, 2) rough places of dots, px of this image, good to about half a pixel; grey: (H, W) uint8, look: look.Look."""
    step = 2 if look.typical >= _SMALLEST_HALVED else 1
    smooth = 2 * int(min(max(look.typical / step / 2.5, 1), 5)) + 1
    box = 2 * int(1.1 * look.typical / step) + 3
    lowest = max(_WEAKEST * abs(look.contrast), _NOISE_PEAK * look.noise / step, 2.0)
    return find_peaks(grey, step=step, smooth=smooth, box=box, sign=1 if look.contrast > 0 else -1, lowest=lowest)
