# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Large markers (from about 5 px across, discs or ellipses, bright or dark): segmented in a small image, fitted in the full one."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import cKDTree

from .blob_moments import cut_necks, find_regions, fit_blobs
from ...common.dots import Dots
from ...common.statistics import upper_median
from ...errors import BadFrame

_ALIKE = 0.6  # channels whose contrasts differ less are averaged: their noise is their own
_FIRST_BOX = 0.1  # of the image's longer side: over which the first frame's ground is averaged
_WIDEST_BOX, _NARROWEST_BOX = 255, 9  # px
_PER_PITCH = 1.1  # side of that box, when markers have been seen
_SMALLEST_HALVED = 8.0  # px across: smaller markers are segmented in the full image
_WEAKEST = 0.15  # of the markers' brightness over the mean around
_LEAST_CONTRAST = 6.0  # grey levels
_SOLID = (0.975, 1.05)  # of an ellipse's area: what is not is hidden in part, or several that could not be told apart
_SMALL_SOLID = (0.8, 1.25)  # the same for small markers, whose pixels are coarse
_LOST_SHARE = 0.6  # of the markers seen at the last look: with fewer, what they look like is measured anew
_LARGE = 1.35  # times the typical area: the region may be several markers that touch
_FAINT = 0.15  # of the typical amplitude: no marker


@dataclass
class _Look:
    """channel: of a BGR image, -1 for their mean; step: of the small image; box: px of the small image; lowest: grey levels; count."""

    channel: int
    step: int
    box: int
    lowest: float
    count: int


class BlobDetector:
    """Markers by grey-weighted sums over regions; sign: 1 for bright markers, -1 for dark. Which channel, which size: from a first look."""

    def __init__(self, sign: int):
        self._sign = sign
        self._look: _Look | None = None

    def detect(self, image: np.ndarray) -> Dots:
        """Markers of one checked uint8 image. Raises BadFrame where there are none."""
        blobs = None if self._look is None else self._find(image)
        if blobs is None or len(blobs) < _LOST_SHARE * self._look.count:
            self._look = _first_look(image, self._sign)
            blobs = self._find(image)
            self._look.count = 0 if blobs is None else len(blobs)
        if blobs is None or not len(blobs):
            raise BadFrame('no region that looks like a marker: check light, focus and the parameter polarity')
        return blobs

    def _find(self, image):
        look = self._look
        grey = _plane(image, look.channel, self._sign)
        small, above = _above(grey, look.step, look.box)
        mask = cv2.threshold(above, look.lowest, 255, cv2.THRESH_BINARY)[1]
        least, most = _SOLID if look.step == 2 else _SMALL_SOLID
        for last in (False, True):
            regions = find_regions(mask)
            if not len(regions):
                return None
            blobs = fit_blobs(grey, small, look.step, regions)
            several = np.flatnonzero((blobs.solidity < least) & (blobs.area > _LARGE * upper_median(blobs.area)))
            if last or not sum(cut_necks(mask, box) for box in regions.box[several]):
                break
        good = (blobs.solidity > least) & (blobs.solidity < most) & (blobs.amplitude > _FAINT * upper_median(blobs.amplitude))
        return Dots(blobs.uv[good], blobs.area[good], blobs.sigma[good])


def _plane(image, channel, sign):
    """One channel, or grey for -1, with the markers bright."""
    if image.ndim == 3:
        image = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if channel < 0 else cv2.extractChannel(image, channel)
    return image if sign > 0 else cv2.bitwise_not(image)


def _above(grey, step, box):
    """The small image, and by how much it is brighter than the mean around."""
    small = cv2.resize(grey, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) if step == 2 else grey
    return small, cv2.subtract(small, cv2.blur(small, (box, box)))


def _best_channel(image) -> int:
    if image.ndim == 2:
        return -1
    spread = cv2.meanStdDev(image)[1][:, 0]
    return -1 if spread.min() > _ALIKE * spread.max() else int(spread.argmax())


def _first_look(image, sign) -> _Look:
    """What markers look like, from regions over Otsu's threshold above the mean around. Raises BadFrame where there are none."""
    channel = _best_channel(image)
    grey = _plane(image, channel, sign)
    box = _odd(_FIRST_BOX * max(grey.shape))
    for _ in range(2):  # the second time with a box that fits the pitch
        _, above = _above(grey, 1, box)
        threshold = cv2.threshold(above, 0, 255, cv2.THRESH_OTSU)[0]
        smooth = cv2.GaussianBlur(above, (3, 3), 0)
        regions = find_regions(cv2.threshold(smooth, max(threshold, _LEAST_CONTRAST), 255, cv2.THRESH_BINARY)[1])
        if len(regions) < 2:
            raise BadFrame('no regions that look like markers: check light, focus and the parameter polarity')
        pitch = float(np.median(cKDTree(regions.centre).query(regions.centre, 2)[0][:, 1]))
        box = _odd(_PER_PITCH * pitch)
    step = 2 if np.sqrt(4 / np.pi * np.median(regions.area)) >= _SMALLEST_HALVED else 1
    contrast = float(above[above > threshold].mean())
    lowest = max(_WEAKEST * contrast, _LEAST_CONTRAST)
    return _Look(channel, step, _odd(box / step), lowest, 0)


def _odd(length) -> int:
    return int(np.clip(length, _NARROWEST_BOX, _WIDEST_BOX)) // 2 * 2 + 1
