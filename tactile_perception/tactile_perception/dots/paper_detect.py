# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The six steps by which the touchpad paper finds dots (section 3.4, eqs 15 and 16), to compare with.

The paper names no threshold. Step 2 is taken as the difference from a local mean, scaled to the full range, step 3 as Otsu's threshold of
it.
"""
from __future__ import annotations

import cv2
import numpy as np

from ..errors import BadFrame
from .dots import Dots

_BLOCK = 31  # px, side of the local mean: more than a dot and its surroundings
_SMALLEST = 6  # px of a region; smaller ones are noise
_LARGEST_SHARE = 0.02  # of the image: larger regions are no dots
_LARGEST_OF_TYPICAL = 4.0


def _emphasise(grey: np.ndarray, sign: int) -> np.ndarray:
    """Step 2: contrast emphasised, dots bright; (H, W) uint8."""
    above = cv2.subtract(cv2.blur(grey, (_BLOCK, _BLOCK)), grey) if sign < 0 else cv2.subtract(grey, cv2.blur(grey, (_BLOCK, _BLOCK)))
    return cv2.normalize(above, None, 0, 255, cv2.NORM_MINMAX)


class PaperDetector:
    """Dots as brightness centres of thresholded regions; sign: 1 for bright dots, -1 for dark."""

    def __init__(self, sign: int):
        self._sign = sign

    def detect(self, image: np.ndarray) -> Dots:
        """All six steps for one checked uint8 image; sigma is the paper's nowhere: NaN. Raises BadFrame where no region is left."""
        grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image
        emphasised = _emphasise(grey, self._sign)
        _, binary = cv2.threshold(emphasised, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
        count, labels, stats, _ = cv2.connectedComponentsWithStats(binary, connectivity=8)
        inverted = cv2.bitwise_not(grey) if self._sign < 0 else grey
        zeroth, first_u, first_v = _moments(inverted, labels, count)
        area = stats[1:, cv2.CC_STAT_AREA].astype(float)
        kept = _dot_sized(area, grey.size) & (zeroth > 0)
        if not kept.any():
            raise BadFrame('no region of a dot\'s size is left after the threshold: check light, focus and the parameter polarity')
        uv = np.stack([first_u[kept], first_v[kept]], 1) / zeroth[kept, None]
        return Dots(uv, area[kept], np.full(len(uv), np.nan))


def _moments(inverted, labels, count):
    """Steps 4 to 6, eq 16: m00, m10 and m01 of the inverted brightness over each region."""
    inside = np.flatnonzero(labels)
    region = labels.ravel()[inside]
    brightness = inverted.ravel()[inside].astype(float)
    row, column = np.divmod(inside, labels.shape[1])
    return tuple(np.bincount(region, brightness * power, count)[1:] for power in (1.0, column, row))


def _dot_sized(area, pixels):
    kept = (area >= _SMALLEST) & (area < _LARGEST_SHARE * pixels)
    if kept.any():
        kept &= area < _LARGEST_OF_TYPICAL * np.median(area[kept])
    return kept
