# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Published detectors: touchpad_contact_region (section 3.4, six steps, eqs 15 and 16), areal_sensor_contact_position (section 2.2) and
air_cushion_contact (section III.A)."""
from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from ...common.dots import Dots
from ...errors import BadFrame

# The papers give no values; chosen for dots of 5 to 15 px at 640 x 480.
_BLOCK = 31  # px, side of the local mean
_SMALLEST = 6  # px of a region; smaller ones are noise
_LARGEST_SHARE = 0.02  # of the image, largest region
_LARGEST_OF_TYPICAL = 4.0  # median areas, largest region


def _emphasise(grey: np.ndarray, sign: int) -> np.ndarray:
    """Step 2: contrast emphasis, with bright dots; (H, W) uint8."""
    above = cv2.subtract(cv2.blur(grey, (_BLOCK, _BLOCK)), grey) if sign < 0 else cv2.subtract(grey, cv2.blur(grey, (_BLOCK, _BLOCK)))
    return cv2.normalize(above, None, 0, 255, cv2.NORM_MINMAX)


class PaperDetector:
    """Dots as grey-weighted centroids of thresholded regions; sign: 1 for bright dots, -1 for dark."""

    def __init__(self, sign: int):
        self._sign = sign

    def detect(self, image: np.ndarray) -> Dots:
        """All six steps for one checked uint8 image; sigma is NaN (the paper has none). Raises BadFrame where no region is left."""
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


_GREEN = 1
_SQUARE = np.ones((3, 3), np.uint8)
_DENOISE = 10.0  # grey levels, strength of the non-local means
_LEAST, _MOST = 0.2, 5.0  # median areas, smallest and largest marker


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

    denoise: replaces the non-local means.
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
    """PaperCushionDetector with a Gaussian of 5 x 5 px in place of the non-local means, which take most of its time."""

    def __init__(self, sign: int):
        super().__init__(sign, _gaussian)


def _non_local_means(grey):
    return cv2.fastNlMeansDenoising(grey, h=_DENOISE)


def _gaussian(grey):
    return cv2.GaussianBlur(grey, (5, 5), 0)


def _bright(grey, sign):
    return grey if sign > 0 else cv2.bitwise_not(grey)


def _dots(uv, area) -> Dots:
    """Dots of a marker's size; sigma is NaN (the papers have none)."""
    area = np.asarray(area, float)
    some = area >= _SMALLEST
    typical = np.median(area[some]) if some.any() else np.nan
    kept = some & (area > _LEAST * typical) & (area < _MOST * typical)
    if not kept.any():
        raise BadFrame('no region of a marker\'s size is left after the threshold: check light, focus and the parameter polarity')
    return Dots(np.asarray(uv, float)[kept], area[kept], np.full(int(kept.sum()), np.nan))
