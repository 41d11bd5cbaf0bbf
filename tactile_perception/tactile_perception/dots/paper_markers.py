# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The marker detectors of the areal sensor's paper (section 2.2) and of the air cushion's (section III.A), to compare with.

Neither gives sizes of its kernels: the smallest, 3 x 3, are taken. Regions far from the typical size are no markers.
"""
from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from ..errors import BadFrame
from .dots import Dots

_GREEN = 1
_SQUARE = np.ones((3, 3), np.uint8)
_DENOISE = 10.0  # grey levels: strength of the non-local means
_SMALLEST = 6  # px^2 of a region; smaller ones are noise
_LEAST, _MOST = 0.2, 5.0  # of the typical area


class PaperArealDetector:
    """Green channel, opening, Otsu's threshold, labels; sign: 1 for bright markers, -1 for dark."""

    def __init__(self, sign: int):
        self._sign = sign

    def detect(self, image: np.ndarray) -> Dots:
        """Markers of one checked uint8 image: centroid and number of their pixels. Raises BadFrame where there are none."""
        green = image if image.ndim == 2 else cv2.extractChannel(image, _GREEN)
        opened = cv2.morphologyEx(_bright(green, self._sign), cv2.MORPH_OPEN, _SQUARE)
        binary = cv2.threshold(opened, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)[1]
        _, _, stats, centre = cv2.connectedComponentsWithStats(binary, connectivity=8)
        return _dots(centre[1:], stats[1:, cv2.CC_STAT_AREA])


class PaperCushionDetector:
    """Grey, non-local means, Otsu's threshold, erosion, contours; sign: 1 for bright markers, -1 for dark.

    denoise: what takes the place of the non-local means.
    """

    def __init__(self, sign: int, denoise: Callable[[np.ndarray], np.ndarray] | None = None):
        self._sign, self._denoise = sign, denoise or _non_local_means

    def detect(self, image: np.ndarray) -> Dots:
        """Markers of one checked uint8 image: centroid and area of their contours. Raises BadFrame where there are none."""
        grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        denoised = self._denoise(_bright(grey, self._sign))
        binary = cv2.threshold(denoised, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)[1]
        contours = cv2.findContours(cv2.erode(binary, _SQUARE), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
        moments = [m for m in map(cv2.moments, contours) if m['m00'] > 0]
        sums = np.array([(m['m00'], m['m10'], m['m01']) for m in moments]).reshape(-1, 3)
        return _dots(sums[:, 1:] / sums[:, :1], sums[:, 0])


class FastCushionDetector(PaperCushionDetector):
    """The same with a Gaussian of 5 x 5 px for the non-local means: no less accurate, in a fiftieth of the time."""

    def __init__(self, sign: int):
        super().__init__(sign, _gaussian)


def _non_local_means(grey):
    return cv2.fastNlMeansDenoising(grey, h=_DENOISE)


def _gaussian(grey):
    return cv2.GaussianBlur(grey, (5, 5), 0)


def _bright(grey, sign):
    return grey if sign > 0 else cv2.bitwise_not(grey)


def _dots(uv, area) -> Dots:
    """Those of a marker's size; sigma is the papers' nowhere: NaN."""
    area = np.asarray(area, float)
    some = area >= _SMALLEST
    typical = np.median(area[some]) if some.any() else np.nan
    kept = some & (area > _LEAST * typical) & (area < _MOST * typical)
    if not kept.any():
        raise BadFrame('no region of a marker\'s size is left after the threshold: check light, focus and the parameter polarity')
    return Dots(np.asarray(uv, float)[kept], area[kept], np.full(int(kept.sum()), np.nan))
