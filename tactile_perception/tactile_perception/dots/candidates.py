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
    if look.contrast < 0:
        small = cv2.bitwise_not(small)
    smooth = 2 * int(np.clip(look.typical / step / 2.5, 1, 5)) + 1
    box = 2 * int(1.1 * look.typical / step) + 3
    above = cv2.subtract(cv2.GaussianBlur(small, (smooth, smooth), 0), cv2.blur(small, (box, box)))
    lowest = max(_WEAKEST * abs(look.contrast), _NOISE_PEAK * look.noise / step, 2.0)
    _, above = cv2.threshold(above, lowest, 255, cv2.THRESH_TOZERO)
    peak = cv2.min(cv2.compare(above, cv2.dilate(above, _SQUARE), cv2.CMP_GE), above)
    peak[[0, -1]] = 0
    peak[:, [0, -1]] = 0
    _, peak = cv2.threshold(peak, 0, 1, cv2.THRESH_BINARY)
    at = np.flatnonzero(peak.view(bool))
    width = small.shape[1]
    flat = peak.ravel()
    at = at[~(flat.take(at - 1) | flat.take(at - width - 1) | flat.take(at - width) | flat.take(at - width + 1)).view(bool)]
    return (_vertices(above.ravel(), at, width) + 0.5) * step - 0.5


def _vertices(above, at, width):
    """(N, 2) tops of parabolas through each peak and its neighbours along columns and rows."""
    middle = above.take(at).astype(np.float32)
    places = np.empty((len(at), 2))
    for axis, step, whole in ((0, 1, at % width), (1, width, at // width)):
        low, high = above.take(at - step).astype(np.float32), above.take(at + step).astype(np.float32)
        bend = np.maximum(2 * middle - low - high, 1.0)
        places[:, axis] = whole + np.minimum(np.maximum((high - low) / (2 * bend), -1.0), 1.0)
    return places
