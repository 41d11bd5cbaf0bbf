# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where dots may be: peaks of a small image against its local ground. Too many rather than too few; the fit decides."""
from __future__ import annotations

import cv2
import numpy as np

_SMALLEST_HALVED = 5.0  # px: dots typically smaller than this are looked for in the full image
_WEAKEST = 0.14  # peak against ground, of the dots' contrast: a small dot where the light is a third
_NOISE_PEAK = 2.0  # standard deviations of a pixel of the small image that smoothing still lets through


def find_candidates(grey: np.ndarray, look) -> np.ndarray:
    """(N, 2) rough places of dots, px of this image, good to about half a pixel; grey: (H, W) uint8, look: look.Look."""
    step = 2 if look.typical >= _SMALLEST_HALVED else 1
    small = cv2.resize(grey, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) if step == 2 else grey
    if look.contrast < 0:
        small = cv2.bitwise_not(small)
    box = 2 * int(1.1 * look.typical / step) + 3
    above = cv2.subtract(cv2.GaussianBlur(small, (5, 5), 0), cv2.blur(small, (box, box)))
    lowest = max(_WEAKEST * abs(look.contrast), _NOISE_PEAK * look.noise / step, 2.0)
    peak = cv2.compare(above, cv2.dilate(above, np.ones((3, 3), np.uint8)), cv2.CMP_GE)
    cv2.bitwise_and(peak, cv2.compare(above, lowest, cv2.CMP_GT), dst=peak)
    peak[[0, -1]] = 0
    peak[:, [0, -1]] = 0
    places = cv2.findNonZero(peak)
    if places is None:
        return np.empty((0, 2))
    column, row = places[:, 0].T
    first = ~(peak[row, column - 1] | peak[row - 1, column - 1] | peak[row - 1, column] | peak[row - 1, column + 1]).astype(bool)
    column, row = column[first], row[first]
    return (_vertices(above, column, row) + 0.5) * step - 0.5


def _vertices(above, column, row):
    """(N, 2) tops of parabolas through each peak and its neighbours."""
    middle = above[row, column].astype(float)
    places = []
    for at, low, high in ((column, above[row, column - 1], above[row, column + 1]), (row, above[row - 1, column], above[row + 1, column])):
        bend = np.maximum(2 * middle - low - high, 1.0)
        places.append(at + np.clip((high.astype(float) - low) / (2 * bend), -1.0, 1.0))
    return np.stack(places, 1)
