# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots of a sensor that nobody described. Where the likelihood fit finds them, it gives their positions; the others, worn, speckled or
textured, are discs at the centroids of their excess over the ground. All of it is a function of the image and of a frozen appearance.
"""
from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np

from .. import _core
from ..common.dots import Dots
from ..common.neighbours import Neighbours
from ..core.errors import BadFrame
from .appearance import (
    CORRELATIONS,
    MIN_DISCS,
    OVERLAP,
    Pattern,
    describe_dots,
    discs_at,
    find_pattern,
    find_peaks,
    joined_peaks,
    own_odds,
    reduced,
    select_channel,
    without_doubles,
)

_MIN_CORRELATION = 0.62  # with a disc, where none is fitted: worn dots have 0.6
_MAX_RATIO = 3.0  # of a disc's contrast to that of the pattern, or its inverse: uneven light
_SHARES = 0.65, 1.0, 1.5  # of the typical diameter, at which discs are searched where none is fitted
_TIE = 1e-3  # decimal log odds by which the correlation decides between overlapping discs of equal odds
_UNSURE = 0.01  # of the diameter, standard deviation of a centroid: worn dots have 0.003 from frame to frame, and jumps of 0.03


class AnyDots:
    """Dots of any polarity and size, whose pattern was found in an image; fit: an exact detector of them, None where they are no discs;
    known: the dots of that image; where as many are fitted, no other is searched."""

    def __init__(self, pattern: Pattern, fit, known: _core.dots.KnownDots | None = None):
        self._pattern, self._fit, self._known = pattern, fit, known

    def describe(self, dots: Dots) -> str:
        """'165 bright dots of 9 px'."""
        diameter = np.sqrt(4 / np.pi * np.median(dots.area))
        return f'{len(dots)} {"bright" if self._pattern.sign > 0 else "dark"} dots of {diameter:.0f} px'

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one checked uint8 image: fitted ones and discs that the fit leaves out, those that are likely to be dots."""
        return self.find(image)[0]

    def find(self, image: np.ndarray) -> tuple[Dots, _core.dots.KnownDots | None]:
        """See `detect`; and what later images are compared with, if this is the first one."""
        pattern, fitted = self._pattern, Dots(np.zeros((0, 2)), np.zeros(0), np.zeros(0))
        grey = select_channel(image, pattern.channel)
        if self._fit is not None:
            fitted = self._fit.detect(image)
            likely = self._likely(fitted, grey)
            if self._known is not None and len(likely[0]) >= self._known.count:
                return likely
        return self._likely(_joined([fitted, _discs(grey, pattern, fitted, self._known)]), grey)

    def _likely(self, dots: Dots, grey) -> tuple[Dots, _core.dots.KnownDots | None]:
        diameter, sign = np.sqrt(4 / np.pi * dots.area), self._pattern.sign
        seen = discs_at(grey, sign, dots.uv, diameter)
        own = own_odds(seen.correlation, diameter)
        kept, _, known = _core.dots.likely_dots(dots.uv, seen.logarithms(sign), own, self._known)
        return dots.take(kept), known


def measure_any(image: np.ndarray, sign: int, make_fit: Callable) -> AnyDots:
    """What dots an image shows; sign: 1 for bright dots, -1 for dark ones, 0 for either; make_fit: Appearance -> an exact detector with
    detect(image) -> Dots. Raises BadFrame without a pattern of dots."""
    pattern, fit = find_pattern(image, (sign,) if sign else (-1, 1)), None
    with suppress(BadFrame):
        fit = make_fit(describe_dots(image, pattern, worn=False))
        away = Neighbours(fit.detect(image).uv).query(pattern.uv)[0]
        if np.mean(away < OVERLAP * pattern.diameter) < MIN_DISCS:
            fit = None
    return AnyDots(pattern, fit, AnyDots(pattern, fit).find(image)[1])


def _discs(grey, pattern, fitted: Dots, known: _core.dots.KnownDots | None) -> Dots:
    """Discs of about the pattern's contrast and diameter where no dot is fitted: the likeliest of those that overlap. Where dots are known,
    those near give the diameter with which each is located."""
    sizes = pattern.diameter * np.array((1.0,) if len(fitted) else _SHARES)
    found = joined_peaks([find_peaks(grey, (pattern.sign,), size)[pattern.sign] for size in sizes])
    free = found.correlation > (CORRELATIONS[0] if len(fitted) else _MIN_CORRELATION)
    free &= np.abs(np.log(found.contrast(pattern.sign) / pattern.contrast)) < np.log(_MAX_RATIO)
    if len(fitted):
        free &= Neighbours(fitted.uv).query(found.uv)[0] > OVERLAP * pattern.diameter
    found = found.take(free)
    odds, size = own_odds(found.correlation, found.diameter) + _TIE * found.correlation, found.diameter
    if known is not None:
        likely, size = known.compare(found.uv, found.logarithms(pattern.sign))
        odds += likely
    alone = without_doubles(found.uv, odds, OVERLAP * found.diameter)
    dots = locate_dots(grey, pattern.sign, found.uv[alone], size[alone])
    return dots.take(without_doubles(dots.uv, dots.area, OVERLAP * np.sqrt(4 / np.pi * dots.area)))


def _joined(parts) -> Dots:
    return Dots(*(np.concatenate([getattr(part, name) for part in parts]) for name in ('uv', 'area', 'sigma')))


def locate_dots(grey: np.ndarray, sign: int, uv: np.ndarray, diameter: np.ndarray | float) -> Dots:
    """Dots of an image (H, W) uint8 near positions uv (N, 2) px of discs of about these diameters (N,), px, or of one, as centroids of what
    is brighter than the ground around them, darker for sign -1."""
    small, scale, _ = reduced(grey, float(np.median(diameter)) if len(uv) else 1.0, np.uint8)
    side = np.broadcast_to(diameter, len(uv)) * scale.mean()
    found = _core.dots.centroids(small, sign, (np.asarray(uv, float) + 0.5) * scale - 0.5, side)
    return Dots((found[:, :2] + 0.5) / scale - 0.5, np.maximum(found[:, 2] / scale.prod(), 1.0), _UNSURE * side / scale.mean())
