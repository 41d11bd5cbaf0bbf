# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots of a sensor that nobody described. Where the likelihood fit finds them, it gives their positions; the others, worn, speckled or
textured, are discs at the centroids of their excess over the ground. All of it is a function of the image and of a frozen appearance.
"""
from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from ..common.dots import Dots
from ..common.neighbours import Neighbours
from ..common.statistics import robust_sigma
from ..errors import BadFrame
from .look import (
    DARKEST,
    LARGEST_FITTED,
    MIN_DOTS,
    OVERLAP,
    Pattern,
    describe_dots,
    discs_at,
    find_pattern,
    find_peaks,
    merge,
    select_channel,
    shrink,
    without_doubles,
)

_CONTRAST_SIGMAS = 5.0  # of the contrasts about those of their neighbours, within which a dot is one of them
_CONTRAST_RANGE = 0.3, 0.8  # logarithm of a contrast over its neighbours', allowed to a disc that no fit confirms, and to a fitted dot
_NEIGHBOURS = 8
_SIZE_RANGE = 0.45, 1.8  # of the typical diameter: dots of several sizes
_MIN_CORRELATION = 0.62  # with a disc: worn dots have 0.6
_MAX_RATIO = 3.0  # of a disc's contrast to that of the pattern, or its inverse: uneven light
_SHARES = 0.65, 1.0, 1.5  # of the typical diameter, at which discs are searched
_ROUND_SHARE, _ROUND_PERCENT = 0.9, 5  # of the correlation that all but so many percent of the fitted dots have: needed by a disc
_AS_MANY = 0.9  # of the discs: with fewer fitted, dots are worn, and all get their centroids
_ROUNDS = 3  # of centroids, each in a window about the last
_WINDOW, _GROUND = 0.65, (0.6, 0.9)  # diameters from a dot's centre: radius of that window, and of the ring of ground around it
_UNSURE = 0.01  # of the diameter, standard deviation of a centroid: worn dots have 0.003 from frame to frame, and jumps of 0.03


class AnyDots:
    """Dots of any polarity and size, whose pattern was found in an image; fit: an exact detector of them, None where they are no discs;
    count: how many discs that image shows, with which no other disc is searched."""

    def __init__(self, pattern: Pattern, fit, count: int = 0):
        self._pattern, self._fit, self._count = pattern, fit, count

    def describe(self, dots: Dots) -> str:
        """'165 bright dots of 9 px'."""
        diameter = np.sqrt(4 / np.pi * np.median(dots.area))
        return f'{len(dots)} {"bright" if self._pattern.sign > 0 else "dark"} dots of {diameter:.0f} px'

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one checked uint8 image that are alike: by the fit, and discs that it leaves out."""
        pattern, fitted = self._pattern, Dots(np.zeros((0, 2)), np.zeros(0), np.zeros(0))
        grey = select_channel(image, pattern.channel)
        if self._fit is not None:
            fitted = self._fit.detect(image)
            fitted = _alike(fitted, fitted, grey, pattern.sign, _CONTRAST_RANGE[1])
            if len(fitted) >= self._count:
                return fitted
        discs = _discs(grey, pattern, fitted)
        if len(fitted) < MIN_DOTS:
            return _alike(discs, discs, grey, pattern.sign, _CONTRAST_RANGE[1])
        discs = _alike(_as_round(discs, fitted, grey, pattern), fitted, grey, pattern.sign, _CONTRAST_RANGE[0])
        return _joined([fitted, discs])


def measure_any(image: np.ndarray, sign: int, make_fit: Callable) -> AnyDots:
    """What dots an image shows; sign: 1 for bright dots, -1 for dark ones, 0 for either; make_fit: Look -> an exact detector with
    detect(image) -> Dots. Raises BadFrame without a pattern of dots."""
    pattern = find_pattern(image, (sign,) if sign else (-1, 1))
    discs = AnyDots(pattern, None)
    try:
        fit = make_fit(describe_dots(image, pattern))
    except BadFrame:
        return discs
    count = max(len(discs.detect(image)), MIN_DOTS)
    return AnyDots(pattern, fit, count) if len(fit.detect(image)) >= _AS_MANY * count else discs


def _discs(grey, pattern, known: Dots) -> Dots:
    """Discs of about the pattern's contrast and diameter where no dot is known."""
    apart = OVERLAP * pattern.diameter
    found = merge([find_peaks(grey, (pattern.sign,), share * pattern.diameter)[pattern.sign] for share in _SHARES], apart)
    free = (found.correlation > _MIN_CORRELATION) & (np.abs(np.log(found.contrast(pattern.sign) / pattern.contrast)) < np.log(_MAX_RATIO))
    if len(known):
        free &= Neighbours(known.uv).query(found.uv)[0] > apart
    found = found.take(free)
    parts = [place_dots(grey, pattern.sign, found.uv[found.diameter == size], size) for size in np.unique(found.diameter)]
    dots = _joined([known.take(slice(0)), *parts])
    return dots.take(without_doubles(dots.uv, dots.area, apart))


def _joined(parts) -> Dots:
    return Dots(*(np.concatenate([getattr(part, name) for part in parts]) for name in ('uv', 'area', 'sigma')))


def _as_round(discs: Dots, fitted: Dots, grey, pattern) -> Dots:
    """Those of the discs that are as round as nearly all fitted dots are."""
    correlation = discs_at(grey, pattern.sign, np.concatenate([discs.uv, fitted.uv]), pattern.diameter).correlation
    return discs.take(correlation[:len(discs)] > _ROUND_SHARE * np.percentile(correlation[len(discs):], _ROUND_PERCENT))


def _alike(dots: Dots, others: Dots, grey, sign, within: float) -> Dots:
    """Those of dots whose size and contrast differ no more than the others' do, or, in the contrast's logarithm, by less than within."""
    if len(others) < MIN_DOTS or not len(dots):
        return dots.take(slice(0))
    tree, count = Neighbours(others.uv), min(_NEIGHBOURS + 1, len(others))

    def measured(some: Dots) -> tuple[np.ndarray, np.ndarray]:  # diameters and logarithms of contrasts
        diameter = np.sqrt(4 / np.pi * some.area)
        return diameter, np.log(np.maximum(_contrast(grey, sign, some.uv, diameter), 1))

    def around(some: Dots) -> np.ndarray:  # usual logarithms of contrasts there
        near = np.partition(usual[tree.query(some.uv, count)[1]], count // 2, axis=1)[:, count // 2]
        return np.clip(near, np.median(usual) - np.log(2), np.median(usual) + np.log(2))
    usual_diameter, usual = measured(others)
    typical, everywhere = np.median(usual_diameter), around(others)
    diameter, contrast, local = (usual_diameter, usual, everywhere) if dots is others else (*measured(dots), around(dots))
    spread = robust_sigma(usual - everywhere)
    good = np.abs(contrast - local) < max(_CONTRAST_SIGMAS * spread, within)
    return dots.take(good & (diameter > _SIZE_RANGE[0] * typical) & (diameter < _SIZE_RANGE[1] * typical))


def _contrast(grey, sign, uv, diameter):
    """(N,) as Peaks.contrast: mean of nine pixels in each dot above the fourth highest of twelve around it: a rim goes through as many."""
    angle = np.r_[0, np.arange(8) * np.pi / 4, np.arange(12) * np.pi / 6]
    away = np.r_[0, np.full(8, 0.28), np.full(12, 0.8)]
    offset = away[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    column, row = (np.clip(np.rint(place[:, None] + diameter[:, None] * off), 0, most - 1).astype(int)
                   for place, off, most in zip(uv.T, offset.T, grey.shape[::-1]))
    levels = sign * grey[row, column].astype(float)
    ground = np.partition(levels[:, 9:], 8, axis=1)[:, 8]
    excess = levels[:, :9].mean(axis=1) - ground
    return excess if sign > 0 else 100 * excess / np.maximum(-ground, DARKEST)


def place_dots(grey: np.ndarray, sign: int, uv: np.ndarray, diameter: float) -> Dots:
    """Dots of an image (H, W) uint8 near positions uv (N, 2) px of discs of about that diameter, px, as centroids of what is brighter than
    the ground around them, darker for sign -1."""
    step = int(diameter / LARGEST_FITTED)
    if step > 1:
        dots = place_dots(shrink(grey, step), sign, (np.asarray(uv) + 0.5) / step - 0.5, diameter / step)
        return Dots((dots.uv + 0.5) * step - 0.5, dots.area * step**2, dots.sigma * step)
    half, most = int(np.ceil(_GROUND[1] * diameter)), np.array(grey.shape[::-1]) - 1
    y, x = np.mgrid[-half:half + 1, -half:half + 1].reshape(2, -1)
    padded = cv2.copyMakeBorder(grey, half, half, half, half, cv2.BORDER_REPLICATE).astype(np.float32) * sign
    far = np.hypot(x, y)
    ring, disc = (far > _GROUND[0] * diameter) & (far < _GROUND[1] * diameter), far < _WINDOW * diameter + 1.5

    def pixels(middle, some):
        """(N, P) of those about each of middle (N, 2)."""
        return padded[middle[:, 1, None] + half + y[some], middle[:, 0, None] + half + x[some]]
    place = np.array(uv, float)
    ground = np.median(pixels(np.clip(np.rint(place).astype(int), 0, most), ring), axis=1)[:, None]
    for _ in range(_ROUNDS):
        middle = np.clip(np.rint(place).astype(int), 0, most)
        off = (place - middle).astype(np.float32)
        away = np.hypot(x[disc].astype(np.float32) - off[:, :1], y[disc].astype(np.float32) - off[:, 1:])
        weight = np.maximum(pixels(middle, disc) - ground, 0) * np.clip(_WINDOW * diameter + 0.5 - away, 0, 1)
        total = np.maximum(weight.sum(axis=1), 1e-3)
        place = middle + np.stack([weight @ x[disc], weight @ y[disc]], axis=1) / total[:, None]
    level = np.maximum((weight**2).sum(axis=1) / total, 1.0)[:, None]
    return Dots(place, np.maximum(np.minimum(weight / level, 1).sum(axis=1), 1.0), np.full(len(place), _UNSURE * diameter))
