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
    smooth = 2 * int(min(max(look.typical / step / 2.5, 1), 5)) + 1
    box = 2 * int(1.1 * look.typical / step) + 3
    spots, around = cv2.GaussianBlur(small, (smooth, smooth), 0), cv2.blur(small, (box, box))
    light, dark = (spots, around) if look.contrast > 0 else (around, spots)
    above = np.maximum(light, dark) - dark
    lowest = max(_WEAKEST * abs(look.contrast), _NOISE_PEAK * look.noise / step, 2.0)
    return ((_tops(above, _peaks(above, min(int(lowest) + 1, 255))) + 0.5) * step - 0.5).T


def _peaks(above, lowest):
    """Flat indices (N,) of pixels off the border that are no less than lowest and their neighbours; the outer columns become zero."""
    width, flat = above.shape[1], above.ravel()
    above[:, ::width - 1] = 0
    row = np.maximum(np.maximum(flat[:-2], flat[2:]), flat[1:-1])
    highest = np.maximum(np.maximum(row[:-2 * width], row[2 * width:]), row[width:-width])
    return np.flatnonzero(flat[width + 1:-width - 1] >= np.maximum(highest, np.uint8(lowest))) + (width + 1)


def _tops(above, at):
    """(2, N) columns and rows of tops of parabolas along both through peaks, flat indices at, of which one is taken where several are
    level."""
    width = above.shape[1]
    near = above.take(at + np.array([-1, -width, -width - 1, 1 - width, 0, 1, width])[:, None])
    first = np.flatnonzero((near[:4] < near[4]).all(0))
    near = near.take(first, axis=1).astype(np.float32)
    low, high = near[:2], near[5:]
    bend = np.maximum(2 * near[4] - low - high, 1.0)
    at = at.take(first)
    row = at // width
    return np.stack([at - row * width, row]) + np.minimum(np.maximum((high - low) / (2 * bend), -1.0), 1.0)
