# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Detectors of dots and markers, by name."""
from __future__ import annotations

from abc import ABC, abstractmethod
from functools import partial

import numpy as np

from tactile_driver.plugins import PluginTable

from .. import _core
from ..common.dots import Dots
from ..core.errors import BadArgument, BadFrame, by_name
from .appearance import MIN_CONTRAST, Appearance, discs_at, find_pattern, measure_appearance, select_channel, shrink
from .auto import measure_any
from .constants import DOT
from .fit import DiscModel

POLARITIES = {'dark': -1, 'bright': 1, 'any': 0}


class Detector(ABC):
    """Finds dots in images. found: what is taken for dots, as a person would say it, ''; measured: how often their appearance was measured,
    0 where it is not."""

    found, measured = '', 0

    @abstractmethod
    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one image, (H, W) or (H, W, 3) BGR uint8, unordered. Raises BadFrame."""


class DotDetector(Detector):
    """Detects printed dots. Their appearance is measured in the first image that shows some, and frozen: what is found is a function of the
    image alone. It is measured again, as a whole, where it no longer fits.

    polarity: 'dark' dots on bright ground or 'bright' ones on dark; method: a name in METHODS. Raises BadArgument for unknown names.
    """

    def __init__(self, polarity: str = 'dark', method: str = 'likelihood'):
        sign, make = by_name(POLARITIES, polarity, 'polarity'), by_name(METHODS, method, 'dot detection method')
        if polarity == 'any' and method != 'auto':
            raise BadArgument(f'detection {method} does not measure the polarity: set polarity to dark or bright, or detection to auto')
        self._method, self._finder, self._count = make(sign), None, 0

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one image, (H, W) or (H, W, 3) BGR uint8, unordered. Raises BadFrame (wrong type or shape, constant, no dots)."""
        check_frame(image)
        if not hasattr(self._method, 'measure'):
            return self._method.detect(image)
        dots = None if self._finder is None else self._finder.detect(image)
        if dots is not None and len(dots) >= max(DOT.lost_share * self._count, 1):
            return dots
        finder = None
        try:
            finder = self._method.measure(image)
            fresh = finder.detect(image)
        except BadFrame:
            if not dots:
                raise
            return dots
        if not len(fresh) or dots and DOT.lost_share * len(fresh) < len(dots):
            if not dots:
                raise BadFrame('no dots found in the frame: check light, focus and the parameter polarity')
            return dots
        self._finder, self._count, self.measured = finder, len(fresh), self.measured + 1
        self.found = finder.describe(fresh) if hasattr(finder, 'describe') else ''
        return fresh


def check_frame(image: np.ndarray):
    """Raise BadFrame for an array that is no image of uint8, is too small, or is constant."""
    if not isinstance(image, np.ndarray) or image.dtype != np.uint8:
        kind = image.dtype if isinstance(image, np.ndarray) else type(image).__name__
        raise BadFrame(f'a frame must be an array of uint8, not {kind}: convert it to mono8 or bgr8')
    if image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] != 3):
        raise BadFrame(f'a frame must be (rows, columns) or (rows, columns, 3), not {image.shape}')
    if min(image.shape[:2]) < DOT.min_frame_side:
        raise BadFrame(f'a frame of {image.shape[1]} x {image.shape[0]} px is too small: at least {DOT.min_frame_side} px a side')
    sample = image[::16]
    low, high = int(sample.min()), int(sample.max())
    if high - low < DOT.min_range:
        name = 'black' if high < 8 else 'white' if low > 247 else 'constant'
        raise BadFrame(f'the frame is {name} (grey levels {low} to {high}): check light, lens cap and exposure')


class LikelihoodFinder:
    """The default: peaks of a reduced image (src/dots/peaks.cpp), then a maximum-likelihood fit of each, without the images of overlapping
    neighbours, and its judgement (src/dots/finder.cpp). appearance: of the dots; limits: what decides what is a dot."""

    def __init__(self, appearance: Appearance, limits: _core.dots.DotLimits | None = None):
        self._appearance, self._limits, self._finders = appearance, limits or _core.dots.DotLimits(), []

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one checked uint8 image; with a larger range of diameters where some exceed that of the appearance."""
        grey = shrink(select_channel(image, self._appearance.channel), self._appearance.step)
        largest, k = self._appearance.largest, 0
        while True:
            if k == len(self._finders):
                model = DiscModel(self._appearance.smallest, largest, self._appearance.blur)
                self._finders.append(_core.dots.DotFinder(model, self._appearance, self._limits))
            found = self._finders[k].find(grey)
            if not found.outgrown or largest > DOT.max_growth * self._appearance.typical:
                return Dots(found.uv, found.area, found.sigma)
            largest, k = DOT.growth * largest, k + 1


class BlobFinder:
    """Markers by grey-weighted moments of regions (src/dots/blobs.hpp). channel: see select_channel."""

    def __init__(self, channel: str, kernel: _core.dots.BlobFinder):
        self._channel, self._kernel = channel, kernel

    def detect(self, image: np.ndarray) -> Dots:
        """Markers of one checked uint8 image."""
        found = self._kernel.find(select_channel(image, self._channel))
        return Dots(found.uv, found.area, found.sigma)


def _measure_markers(image, sign) -> BlobFinder:
    """Finder of markers like those of an image. Raises BadFrame without a pattern."""
    pattern = find_pattern(image, (sign,))
    discs = discs_at(select_channel(image, pattern.channel), sign, pattern.uv, pattern.diameter)
    step = 2 if pattern.diameter >= DOT.min_halved_diameter else 1
    threshold = max(DOT.segmentation_share * float(np.median(discs.amplitude)), MIN_CONTRAST)
    box = int(DOT.mean_side * pattern.pitch / step) // 2 * 2 + 1
    return BlobFinder(pattern.channel, _core.dots.BlobFinder(sign, step, box, threshold, np.pi / 4 * (pattern.diameter / step)**2))


class _Measured:
    """Measures the appearance of the dots of an image, by a function of image and sign."""

    def __init__(self, function, sign: int):
        self._function, self._sign = function, sign

    def measure(self, image: np.ndarray):
        """An object with detect(image) -> Dots. Raises BadFrame without dots."""
        return self._function(image, self._sign)


#: (sign) -> an object with detect(image) -> Dots, a function of the image alone, or with measure(image) -> such an object
METHODS = PluginTable('tactile_perception.dot_detectors', {
    'auto': partial(_Measured, partial(measure_any, make_fit=LikelihoodFinder)),
    'likelihood': partial(_Measured, lambda image, sign: LikelihoodFinder(measure_appearance(image, sign))),
    'blobs': partial(_Measured, _measure_markers),
    'paper': 'tactile_perception.published.touchpad_contact_region:PaperDetector',
    'paper_areal': 'tactile_perception.published.areal_sensor_contact_position:PaperArealDetector',
    'paper_cushion': 'tactile_perception.published.air_cushion_contact:PaperCushionDetector',
})
