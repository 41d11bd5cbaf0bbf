# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Detector of large markers (from about 5 px, discs or ellipses): segmentation in a reduced image, moments in the full one."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from tactile_perception._core import nearest_others

from .blob_moments import cut_necks, find_regions, fit_blobs
from ...common.dots import Dots
from ...common.statistics import upper_median
from ...errors import BadFrame

_ALIKE = 0.6  # ratio of channel contrasts from which channels are averaged, since their noise is independent. Chosen
_FIRST_BOX = 0.1  # of the image's longer side: box of the local mean before the pitch is known. Chosen
_WIDEST_BOX, _NARROWEST_BOX = 255, 9  # px, bounds of that box
_PER_PITCH = 1.1  # pitches, side of that box afterwards. Chosen: a little over one marker with its ground
_SMALLEST_HALVED = 8.0  # px: smaller markers are segmented in the full image. Chosen
_WEAKEST = 0.15  # of the markers' contrast, threshold of the segmentation. Chosen
_LEAST_CONTRAST = 6.0  # grey levels. Chosen
_SOLID = (0.975, 1.05)  # solidity of one whole marker; others are partly hidden or overlap. Chosen
_SMALL_SOLID = (0.8, 1.25)  # the same for small markers, whose pixels are coarse. Chosen
_LOST_SHARE = 0.6  # of the markers at the last measurement of the appearance; with fewer, it is measured anew. Chosen
_LARGE = 1.35  # typical areas, from which a region may hold overlapping markers. Chosen
_FAINT = 0.15  # of the typical amplitude, least of a marker. Chosen


@dataclass
class _Appearance:
    """channel: of a BGR image, -1 for grey; step: reduction of the small image; box: its px, of the local mean; lowest: grey levels,
    threshold; count: of markers."""

    channel: int
    step: int
    box: int
    lowest: float
    count: int


class BlobDetector:
    """Markers by grey-weighted moments of regions; sign: 1 for bright markers, -1 for dark. The first frame gives channel and size."""

    def __init__(self, sign: int):
        self._sign = sign
        self._appearance: _Appearance | None = None

    def detect(self, image: np.ndarray) -> Dots:
        """Markers of one checked uint8 image. Raises BadFrame without a marker."""
        blobs = None if self._appearance is None else self._find(image)
        if blobs is None or len(blobs) < _LOST_SHARE * self._appearance.count:
            self._appearance = _measure_appearance(image, self._sign)
            blobs = self._find(image)
            self._appearance.count = 0 if blobs is None else len(blobs)
        if blobs is None or not len(blobs):
            raise BadFrame('no marker found in the frame: check light, focus and the parameter polarity')
        return blobs

    def _find(self, image):
        appearance = self._appearance
        grey = _plane(image, appearance.channel, self._sign)
        small, above = _above(grey, appearance.step, appearance.box)
        mask = cv2.threshold(above, appearance.lowest, 255, cv2.THRESH_BINARY)[1]
        least, most = _SOLID if appearance.step == 2 else _SMALL_SOLID
        for last in (False, True):
            regions = find_regions(mask)
            if not len(regions):
                return None
            blobs = fit_blobs(grey, small, appearance.step, regions)
            several = np.flatnonzero((blobs.solidity < least) & (blobs.area > _LARGE * upper_median(blobs.area)))
            if last or not sum(cut_necks(mask, box) for box in regions.box[several]):
                break
        good = (blobs.solidity > least) & (blobs.solidity < most) & (blobs.amplitude > _FAINT * upper_median(blobs.amplitude))
        return Dots(blobs.uv[good], blobs.area[good], blobs.sigma[good])


def _plane(image, channel, sign):
    """One channel, or grey for -1, inverted for dark markers."""
    if image.ndim == 3:
        image = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if channel < 0 else cv2.extractChannel(image, channel)
    return image if sign > 0 else cv2.bitwise_not(image)


def _above(grey, step, box):
    """The small image, and its excess over the local mean."""
    small = cv2.resize(grey, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) if step == 2 else grey
    return small, cv2.subtract(small, cv2.blur(small, (box, box)))


def _best_channel(image) -> int:
    if image.ndim == 2:
        return -1
    spread = cv2.meanStdDev(image)[1][:, 0]
    return -1 if spread.min() > _ALIKE * spread.max() else int(spread.argmax())


def _measure_appearance(image, sign) -> _Appearance:
    """Appearance of markers, from regions over Otsu's threshold of the excess over the local mean. Raises BadFrame without markers."""
    channel = _best_channel(image)
    grey = _plane(image, channel, sign)
    box = _odd(_FIRST_BOX * max(grey.shape))
    for _ in range(2):  # the second time with a box that fits the pitch
        _, above = _above(grey, 1, box)
        threshold = cv2.threshold(above, 0, 255, cv2.THRESH_OTSU)[0]
        smooth = cv2.GaussianBlur(above, (3, 3), 0)
        regions = find_regions(cv2.threshold(smooth, max(threshold, _LEAST_CONTRAST), 255, cv2.THRESH_BINARY)[1])
        if len(regions) < 2:
            raise BadFrame('fewer than two markers found in the frame: check light, focus and the parameter polarity')
        pitch = float(np.median(nearest_others(np.asarray(regions.centre, float), count=1)[1]))
        box = _odd(_PER_PITCH * pitch)
    step = 2 if np.sqrt(4 / np.pi * np.median(regions.area)) >= _SMALLEST_HALVED else 1
    contrast = float(above[above > threshold].mean())
    lowest = max(_WEAKEST * contrast, _LEAST_CONTRAST)
    return _Appearance(channel, step, _odd(box / step), lowest, 0)


def _odd(length) -> int:
    return int(np.clip(length, _NARROWEST_BOX, _WIDEST_BOX)) // 2 * 2 + 1
