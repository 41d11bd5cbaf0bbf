# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots in an image: the detector that the rest stands on, and the table of methods it can use."""
from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from ..errors import BadArgument, BadFrame
from .candidates import find_candidates
from .crowd import Separator
from .dots import Dots
from .ground import relative_slopes
from .look import Look, measure_look, select_channel, shrink
from .paper_detect import PaperDetector
from .subpixel import LikelihoodFitter

POLARITIES = {'dark': -1, 'bright': 1}
_FEWEST = 4  # dots: with fewer, what dots look like is measured anew
_OFF_CENTRE = 0.9  # px from its patch's centre at which a dot is fitted in a new patch
_MOST_GROWTH = 2.2  # times the typical diameter: dots are not looked for beyond
_SMALLEST_FRAME = 32  # px


class DotDetector:
    """Finds printed dots; what they look like is measured in the first good frame and again when they stop looking so.

    polarity: 'dark' dots on bright ground or 'bright' ones on dark; method: a name in METHODS. Raises BadArgument for other names.
    """

    def __init__(self, polarity: str = 'dark', method: str = 'likelihood'):
        if polarity not in POLARITIES:
            raise BadArgument(f'polarity {polarity!r} is unknown: choose from {", ".join(POLARITIES)}')
        if method not in METHODS:
            raise BadArgument(f'dot detection method {method!r} is unknown: choose from {", ".join(METHODS)}')
        self._method = METHODS[method](POLARITIES[polarity])

    def detect(self, image: np.ndarray) -> Dots:
        """The dots of one image, (H, W) or (H, W, 3) BGR uint8, in no order. Raises BadFrame (black, white, constant, no dots, wrong type
        or shape)."""
        check_frame(image)
        return self._method.detect(image)


def check_frame(image: np.ndarray):
    """Raise BadFrame, saying why, unless this is a picture that may hold dots."""
    if not isinstance(image, np.ndarray) or image.dtype != np.uint8:
        kind = image.dtype if isinstance(image, np.ndarray) else type(image).__name__
        raise BadFrame(f'a frame must be an array of uint8, this is {kind}: convert it to mono8 or bgr8')
    if image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] != 3):
        raise BadFrame(f'a frame must be (rows, columns) or (rows, columns, 3), this is {image.shape}')
    if min(image.shape[:2]) < _SMALLEST_FRAME:
        raise BadFrame(f'a frame of {image.shape[1]} x {image.shape[0]} px is too small for dots: at least {_SMALLEST_FRAME} px a side')
    sample = image[::16]
    low, high = int(sample.min()), int(sample.max())
    if high - low < 4:
        name = 'black' if high < 8 else 'white' if low > 247 else 'constant'
        raise BadFrame(f'the frame is {name} (grey levels {low} to {high}): check light, lens cap and exposure')


class LikelihoodDetector:
    """Peaks of the half-size image, then a likelihood fit of each (candidates.py, subpixel.py, ground.py)."""

    def __init__(self, sign: int):
        self._sign = sign
        self._look: Look | None = None
        self._fitter: LikelihoodFitter | None = None
        self._separator: Separator | None = None
        self._outgrown = False

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one checked uint8 image; raises BadFrame where there are none."""
        if self._look is not None:
            dots = self._detect_all_sizes(image)
            if len(dots) >= _FEWEST:
                return dots
        self._look = None  # if measuring fails, the next frame starts from nothing too
        self._take(measure_look(image, self._sign))
        dots = self._detect_all_sizes(image)
        if len(dots) < _FEWEST:
            raise BadFrame(f'only {len(dots)} dots found in the frame: check light, focus and the parameter polarity')
        return dots

    def _take(self, look):
        self._fitter = LikelihoodFitter(look.smallest, look.largest, look.blur)
        self._separator = Separator(look, self._fitter)
        self._look = look

    def _detect_all_sizes(self, image):
        """Detect, and once more with larger dots in mind if some have grown out of the tables."""
        self._outgrown = False
        dots = self._detect(image)
        if self._outgrown and self._look.largest < _MOST_GROWTH * self._look.typical:
            self._take(replace(self._look, largest=1.15 * self._look.largest))
            dots = self._detect(image)
        return dots

    def _detect(self, image):
        look, fitter = self._look, self._fitter
        grey = shrink(select_channel(image, look.channel), look.step)
        places = find_candidates(grey, look)
        if not len(places):
            return Dots(np.empty((0, 2)), np.empty(0), np.empty(0))
        padded = cv2.copyMakeBorder(grey, *[fitter.half] * 4, cv2.BORDER_REPLICATE)
        centre = np.rint(places).astype(np.int64)
        compressed = fitter.compress(fitter.patches(padded, centre[:, 0], centre[:, 1], look.ground))
        offset = places - centre
        fit = fitter.fit(compressed, offset[:, 0], offset[:, 1], np.full(len(places), look.typical), 2)
        self._recentre(fit, compressed, padded, places, centre)
        fit, compressed, single = self._separator.separate(fit, compressed, places, centre)
        variance = fitter.variances(compressed, fit)
        fit.ground += look.ground
        good = self._plausible(fit, variance, centre, grey.shape) & single
        u, v = centre[:, 0] + fit.u, centre[:, 1] + fit.v
        fitter.correct_slope(fit, *relative_slopes(u, v, fit.ground, good, 2.5 * look.typical))
        uv = np.stack([centre[:, 0] + fit.u, centre[:, 1] + fit.v], 1)[good]
        sigma = np.sqrt(variance * fitter.gains(fit)[0])[good]
        return Dots((uv + 0.5) * look.step - 0.5, np.pi / 4 * (fit.diameter[good] * look.step) ** 2, sigma * look.step)

    def _recentre(self, fit, compressed, padded, places, centre):
        """Fit dots whose peak lay off their place once more, in place, from patches about where they were found."""
        off = np.flatnonzero((np.maximum(np.abs(fit.u), np.abs(fit.v)) > _OFF_CENTRE) & (fit.amplitude * self._sign > 0))
        # of dots that touch, the fit may have gone over to the neighbour: crowd.py begins with these at their peaks again
        near = np.hypot(*(places[off, None] - places).transpose(2, 0, 1)) < self._look.typical + 2
        off = off[near.sum(1) == 1]
        if not len(off):
            return
        step = np.rint(np.stack([fit.u[off], fit.v[off]], 1)).astype(np.int64)
        limit = [padded.shape[1] - 2 * self._fitter.half - 1, padded.shape[0] - 2 * self._fitter.half - 1]
        centre[off] = np.clip(centre[off] + step, 0, limit)
        compressed[off] = self._fitter.compress(self._fitter.patches(padded, centre[off, 0], centre[off, 1], self._look.ground))
        fit.put(off, self._fitter.fit(compressed[off], fit.u[off] - step[:, 0], fit.v[off] - step[:, 1], fit.diameter[off], 2))

    def _plausible(self, fit, variance, centre, shape):
        """(N,) bool: of the dots' contrast and size, like a disc, whole."""
        look = self._look
        contrast = fit.amplitude * self._sign
        good = (contrast > 0.2 * abs(look.contrast)) & (fit.diameter > look.smallest)
        good &= self._like_disc(contrast, np.sqrt(variance), good)
        good &= (np.abs(fit.u) < 1.4) & (np.abs(fit.v) < 1.4)
        u, v, reach = centre[:, 0] + fit.u, centre[:, 1] + fit.v, fit.diameter / 2 + look.blur - 0.5
        good &= (u >= reach) & (v >= reach) & (u <= shape[1] - 1 - reach) & (v <= shape[0] - 1 - reach)
        small = fit.diameter < look.largest
        self._outgrown = bool((good & ~small).any())
        return good & small

    def _like_disc(self, contrast, rest, good):
        """(N,) bool: little is left of a dot's pixels; more is allowed where all dots are unlike discs, as after lossy compression."""
        look = self._look
        most = np.maximum(max(4 * look.noise, 0.1 * abs(look.contrast)), 0.12 * contrast)
        like = rest < most
        if (good & ~like).any():
            usual = np.median(rest[good] / contrast[good])
            like |= rest < contrast * min(1.7 * usual, 0.2)
        return like


METHODS = {'likelihood': LikelihoodDetector, 'paper': PaperDetector}
