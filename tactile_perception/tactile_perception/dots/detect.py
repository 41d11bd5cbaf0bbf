# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Detectors of dots and markers, by name."""
from __future__ import annotations

from dataclasses import replace
from functools import partial

import cv2
import numpy as np

from .. import _core
from ..common.dots import Dots
from ..errors import BadArgument, BadFrame
from .auto import AutoDetector
from .fit import DiscModel
from .look import Look, measure_look, select_channel, shrink
from .published import PaperArealDetector, PaperCushionDetector, PaperDetector

POLARITIES = {'dark': -1, 'bright': 1, 'any': 0}
_SMALLEST_FRAME = 32  # px, shorter side of a frame: the detectors average over boxes of 15 px and more
_LEAST_RANGE = 4  # grey levels; less is a constant frame: above the noise of a covered camera

# The likelihood detector
_FEWEST = 4  # dots; with fewer, the appearance is measured again
_MOST_GROWTH = 2.2  # times the typical diameter: the largest diameter searched
_HALVED = 5.0  # px: dots from this diameter on are searched in an image of half the size
_WEAKEST, _ABOVE_NOISE = 0.14, 2.0  # lowest peak: of the contrast, which admits a small dot in a third of the light; of the noise
_SQUARE = np.ones((3, 3), np.uint8)


class DotDetector:
    """Detects printed dots. Methods measure the dots' appearance in the first good frame, and again when it changes.

    polarity: 'dark' dots on bright ground or 'bright' ones on dark; method: a name in METHODS. Raises BadArgument for unknown names.
    """

    def __init__(self, polarity: str = 'dark', method: str = 'likelihood'):
        if polarity not in POLARITIES:
            raise BadArgument(f'polarity {polarity!r} is unknown: choose from {", ".join(POLARITIES)}')
        if method not in METHODS:
            raise BadArgument(f'dot detection method {method!r} is unknown: choose from {", ".join(METHODS)}')
        if polarity == 'any' and method != 'auto':
            raise BadArgument(f'detection {method} does not measure the polarity: set polarity to dark or bright, or detection to auto')
        self._method = METHODS[method](POLARITIES[polarity])

    @property
    def found(self) -> str:
        """What the method takes for dots, where it measures that; ''."""
        return getattr(self._method, 'found', '')

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one image, (H, W) or (H, W, 3) BGR uint8, unordered. Raises BadFrame (wrong type or shape, constant, no dots)."""
        check_frame(image)
        return self._method.detect(image)


def check_frame(image: np.ndarray):
    """Raise BadFrame for an array that is no image of uint8, is too small, or is constant."""
    if not isinstance(image, np.ndarray) or image.dtype != np.uint8:
        kind = image.dtype if isinstance(image, np.ndarray) else type(image).__name__
        raise BadFrame(f'a frame must be an array of uint8, not {kind}: convert it to mono8 or bgr8')
    if image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] != 3):
        raise BadFrame(f'a frame must be (rows, columns) or (rows, columns, 3), not {image.shape}')
    if min(image.shape[:2]) < _SMALLEST_FRAME:
        raise BadFrame(f'a frame of {image.shape[1]} x {image.shape[0]} px is too small: at least {_SMALLEST_FRAME} px a side')
    sample = image[::16]
    low, high = int(sample.min()), int(sample.max())
    if high - low < _LEAST_RANGE:
        name = 'black' if high < 8 else 'white' if low > 247 else 'constant'
        raise BadFrame(f'the frame is {name} (grey levels {low} to {high}): check light, lens cap and exposure')


class LikelihoodDetector:
    """The default: peaks of a reduced image, then a maximum-likelihood fit of each, without the images of overlapping neighbours, and its
    judgement (src/dots/finder.cpp). sign: 1 for bright dots, -1 for dark; look: of the dots, measured in the first frame by default;
    limits: what decides what is a dot."""

    def __init__(self, sign: int, look: Look | None = None, limits: _core.dots.DotLimits | None = None):
        self._sign, self._limits = sign, limits or _core.dots.DotLimits()
        self._look, self._finder = None, None
        if look is not None:
            self._take(look)

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one checked uint8 image. Raises BadFrame if there are none."""
        if self._look is not None:
            dots = self.detect_all(image)
            if len(dots) >= _FEWEST:
                return dots
        before = self._look, self._finder
        try:
            return self._detect_anew(image)
        except BadFrame:  # this frame alone may be bad; measuring the appearance again is costly
            self._look, self._finder = before
            raise

    def _detect_anew(self, image):
        """Measure the appearance of dots in this image and detect them. Raises BadFrame for fewer than _FEWEST."""
        self._take(measure_look(image, self._sign))
        dots = self.detect_all(image)
        if len(dots) < _FEWEST:
            raise BadFrame(f'only {len(dots)} dots found in the frame: check light, focus and the parameter polarity')
        return dots

    def _take(self, look):
        model = DiscModel(look.smallest, look.largest, look.blur)
        self._look, self._finder = look, _core.dots.DotFinder(model, look, self._limits)

    def detect_all(self, image: np.ndarray) -> Dots:
        """Dots of the look that is known. Detect, and repeat with a larger range of diameters if some dots exceed it."""
        grey = shrink(select_channel(image, self._look.channel), self._look.step)
        found = self._finder.find(grey, _candidates(grey, self._look))
        if found.outgrown and self._look.largest < _MOST_GROWTH * self._look.typical:
            self._take(replace(self._look, largest=1.15 * self._look.largest))
            found = self._finder.find(grey, _candidates(grey, self._look))
        return Dots(found.uv, found.area, found.sigma)


def _candidates(grey: np.ndarray, look: Look) -> np.ndarray:
    """(N, 2) px: peaks of an image (H, W) uint8, smoothed, above the mean of a square around. The fit rejects false ones."""
    step = 2 if look.typical >= _HALVED else 1
    small, across = shrink(grey, step).astype(np.float32), look.typical / step
    side, box = 2 * int(np.clip(across / 2.5, 1, 5)) + 1, 2 * int(1.1 * across) + 3
    relief = cv2.GaussianBlur(small, (side, side), 0, borderType=cv2.BORDER_REPLICATE)
    relief -= cv2.blur(small, (box, box), borderType=cv2.BORDER_REPLICATE)
    if look.contrast < 0:
        relief = -relief
    lowest = max(_WEAKEST * abs(look.contrast), _ABOVE_NOISE * look.noise / step, 2.0)
    peak = (relief >= cv2.dilate(relief, _SQUARE)) & (relief > lowest)
    v, u = np.nonzero(peak[1:-1, 1:-1])
    v, u = v + 1, u + 1
    middle, places = relief[v, u], np.empty((len(u), 2))
    for axis, (before, after) in enumerate(((relief[v, u - 1], relief[v, u + 1]), (relief[v - 1, u], relief[v + 1, u]))):
        places[:, axis] = (u, v)[axis] + np.clip((after - before) / (2 * np.maximum(2 * middle - before - after, 1)), -1, 1)
    return (places + 0.5) * step - 0.5


METHODS = {'auto': partial(AutoDetector, make_fit=LikelihoodDetector), 'likelihood': LikelihoodDetector, 'blobs': AutoDetector,
           'paper': PaperDetector, 'paper_areal': PaperArealDetector, 'paper_cushion': PaperCushionDetector}
