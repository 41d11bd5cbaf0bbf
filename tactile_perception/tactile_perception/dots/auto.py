# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots of a sensor that nobody described. Where the likelihood fit finds them, it gives their positions; the others, worn, speckled or
textured, are discs at the centroids of their excess over the ground. All of it is a function of the image and of a frozen appearance.
"""
from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import cv2
import numpy as np

from ..common.dots import Dots
from ..common.neighbours import Neighbours
from ..core.errors import BadFrame
from .appearance import (
    CORRELATIONS,
    MIN_DISCS,
    OVERLAP,
    KnownDots,
    Pattern,
    describe_dots,
    discs_at,
    find_pattern,
    find_peaks,
    joined_peaks,
    likely_dots,
    own_odds,
    reduced,
    select_channel,
    without_doubles,
)

_MIN_CORRELATION = 0.62  # with a disc, where none is fitted: worn dots have 0.6
_MAX_RATIO = 3.0  # of a disc's contrast to that of the pattern, or its inverse: uneven light
_SHARES = 0.65, 1.0, 1.5  # of the typical diameter, at which discs are searched where none is fitted
_TIE = 1e-3  # decimal log odds by which the correlation decides between overlapping discs of equal odds
_SIZES = 4  # an octave, of the diameters with which dots are placed
_ROUNDS = 3  # of centroids, each in a window about the last
_WINDOW, _GROUND = 0.65, (0.6, 0.9)  # diameters from a dot's centre: radius of that window, and of the ring of ground around it
_UNSURE = 0.01  # of the diameter, standard deviation of a centroid: worn dots have 0.003 from frame to frame, and jumps of 0.03


class AnyDots:
    """Dots of any polarity and size, whose pattern was found in an image; fit: an exact detector of them, None where they are no discs;
    known: the dots of that image; where as many are fitted, no other is searched."""

    def __init__(self, pattern: Pattern, fit, known: KnownDots | None = None):
        self._pattern, self._fit, self._known = pattern, fit, known

    def describe(self, dots: Dots) -> str:
        """'165 bright dots of 9 px'."""
        diameter = np.sqrt(4 / np.pi * np.median(dots.area))
        return f'{len(dots)} {"bright" if self._pattern.sign > 0 else "dark"} dots of {diameter:.0f} px'

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one checked uint8 image: fitted ones and discs that the fit leaves out, those that are likely to be dots."""
        return self.find(image)[0]

    def find(self, image: np.ndarray) -> tuple[Dots, KnownDots | None]:
        """See `detect`; and what later images are compared with, if this is the first one."""
        pattern, fitted = self._pattern, Dots(np.zeros((0, 2)), np.zeros(0), np.zeros(0))
        grey = select_channel(image, pattern.channel)
        if self._fit is not None:
            fitted = self._fit.detect(image)
            likely = self._likely(fitted, grey)
            if self._known is not None and len(likely[0]) >= len(self._known.uv):
                return likely
        return self._likely(_joined([fitted, _discs(grey, pattern, fitted, self._known)]), grey)

    def _likely(self, dots: Dots, grey) -> tuple[Dots, KnownDots | None]:
        diameter, sign = np.sqrt(4 / np.pi * dots.area), self._pattern.sign
        seen = discs_at(grey, sign, dots.uv, diameter)
        kept, _, known = likely_dots(dots.uv, seen.logarithms(sign), own_odds(seen.correlation, diameter), self._known)
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


def _discs(grey, pattern, fitted: Dots, known: KnownDots | None) -> Dots:
    """Discs of about the pattern's contrast and diameter where no dot is fitted: the likeliest of those that overlap. Where dots are known,
    those near give the diameter that each is placed with."""
    sizes = pattern.diameter * np.array((1.0,) if len(fitted) else _SHARES)
    found = joined_peaks([find_peaks(grey, (pattern.sign,), size)[pattern.sign] for size in sizes])
    free = found.correlation > (CORRELATIONS[0] if len(fitted) else _MIN_CORRELATION)
    free &= np.abs(np.log(found.contrast(pattern.sign) / pattern.contrast)) < np.log(_MAX_RATIO)
    if len(fitted):
        free &= Neighbours(fitted.uv).query(found.uv)[0] > OVERLAP * pattern.diameter
    found = found.take(free)
    odds = own_odds(found.correlation, found.diameter) + _TIE * found.correlation
    if known is not None:
        odds += known.odds(found.uv, found.logarithms(pattern.sign))
    found = found.take(without_doubles(found.uv, odds, OVERLAP * found.diameter))
    size = found.diameter if known is None else 2**(np.rint(_SIZES * np.log2(known.diameters_at(found.uv))) / _SIZES)
    dots = _joined([fitted.take(slice(0)), *(place_dots(grey, pattern.sign, found.uv[size == each], each) for each in np.unique(size))])
    return dots.take(without_doubles(dots.uv, dots.area, OVERLAP * np.sqrt(4 / np.pi * dots.area)))


def _joined(parts) -> Dots:
    return Dots(*(np.concatenate([getattr(part, name) for part in parts]) for name in ('uv', 'area', 'sigma')))


def place_dots(grey: np.ndarray, sign: int, uv: np.ndarray, diameter: float) -> Dots:
    """Dots of an image (H, W) uint8 near positions uv (N, 2) px of discs of about that diameter, px, as centroids of what is brighter than
    the ground around them, darker for sign -1."""
    small, scale, diameter = reduced(grey, diameter)
    half, most = int(np.ceil(_GROUND[1] * diameter)), np.array(small.shape[::-1]) - 1
    y, x = np.mgrid[-half:half + 1, -half:half + 1].reshape(2, -1)
    padded = cv2.copyMakeBorder(small, half, half, half, half, cv2.BORDER_REPLICATE) * sign
    far = np.hypot(x, y)
    ring, disc = (far > _GROUND[0] * diameter) & (far < _GROUND[1] * diameter), far < _WINDOW * diameter + 1.5

    def pixels(middle, some):
        """(N, P) of those about each of middle (N, 2)."""
        return padded[middle[:, 1, None] + half + y[some], middle[:, 0, None] + half + x[some]]
    place = (np.asarray(uv, float) + 0.5) * scale - 0.5
    ground = np.median(pixels(np.clip(np.rint(place).astype(int), 0, most), ring), axis=1)[:, None]
    for _ in range(_ROUNDS):
        middle = np.clip(np.rint(place).astype(int), 0, most)
        off = (place - middle).astype(np.float32)
        away = np.hypot(x[disc].astype(np.float32) - off[:, :1], y[disc].astype(np.float32) - off[:, 1:])
        weight = np.maximum(pixels(middle, disc) - ground, 0) * np.clip(_WINDOW * diameter + 0.5 - away, 0, 1)
        total = np.maximum(weight.sum(axis=1), 1e-3)
        place = middle + np.stack([weight @ x[disc], weight @ y[disc]], axis=1) / total[:, None]
    level = np.maximum((weight**2).sum(axis=1) / total, 1.0)[:, None]
    area = np.minimum(weight / level, 1).sum(axis=1) / scale.prod()
    return Dots((place + 0.5) / scale - 0.5, np.maximum(area, 1.0), np.full(len(place), _UNSURE * diameter / scale.mean()))
