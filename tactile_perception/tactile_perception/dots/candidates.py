# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where dots may be: peaks of a small image against its local ground. Too many rather than too few; the fit decides."""
from __future__ import annotations

import cv2
import numpy as np

_SMALLEST_HALVED = 5.0  # px: dots typically smaller than this are looked for in the full image
_WEAKEST = 0.14  # peak against ground, of the dots' contrast: a small dot where the light is a third
_SQUARE = np.ones((3, 3), np.uint8)
_NOISE_PEAK = 2.0  # standard deviations of a pixel of the small image that smoothing still lets through


def find_candidates(grey: np.ndarray, look) -> np.ndarray:
    """(N, 2) rough places of dots, px of this image, good to about half a pixel; grey: (H, W) uint8, look: look.Look."""
    step = 2 if look.typical >= _SMALLEST_HALVED else 1
    small = cv2.resize(grey, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) if step == 2 else grey
    smooth = 2 * int(np.clip(look.typical / step / 2.5, 1, 5)) + 1
    box = 2 * int(1.1 * look.typical / step) + 3
    spots, around = cv2.GaussianBlur(small, (smooth, smooth), 0), cv2.blur(small, (box, box))
    above = cv2.subtract(spots, around) if look.contrast > 0 else cv2.subtract(around, spots)
    lowest = max(_WEAKEST * abs(look.contrast), _NOISE_PEAK * look.noise / step, 2.0)
    peak = cv2.compare(above, np.maximum(cv2.dilate(above, _SQUARE), np.uint8(min(int(lowest) + 1, 255))), cv2.CMP_GE)
    peak[[0, -1]] = 0
    peak[:, [0, -1]] = 0
    _, peak = cv2.threshold(peak, 0, 1, cv2.THRESH_BINARY)
    return (_tops(above, np.flatnonzero(peak.view(bool))) + 0.5) * step - 0.5


def _tops(above, at):
    """(N, 2) tops of parabolas along columns and rows through peaks, flat indices at, of which one is taken where several are level."""
    width = above.shape[1]
    around = np.array([-width - 1, -width, -width + 1, -1, 0, 1, width - 1, width, width + 1])
    near = above.take(at + around[:, None])
    first = np.flatnonzero((near[:4] < near[4]).all(0))
    near = near[:, first].astype(np.float32)
    low, high = near[[3, 1]], near[[5, 7]]
    bend = np.maximum(2 * near[4] - low - high, 1.0)
    row, column = np.divmod(at[first], width)
    return (np.stack([column, row]) + np.minimum(np.maximum((high - low) / (2 * bend), -1.0), 1.0)).T
