# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots of a sensor that nobody described: look.py measures in the first image what they are. Where the likelihood fit finds as many, it
places the dots. Else they are worn, speckled or textured, and placed at their centroids.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
import scipy

from ..common.dots import Dots
from ..common.statistics import robust_sigma
from ..errors import BadFrame
from .look import FEWEST, LARGEST_FITTED, LEAST, LOWER, Kind, correlate, describe_dots, find_kind, find_peaks, select_channel, shrink

_DEVIATIONS = 5.0  # standard deviations between a dot's contrast and its neighbours'
_ALIKE = 0.3, 0.8  # logarithm of a contrast over its neighbours': of discs that no fit confirms; of dots, since light varies
_NEIGHBOURS = 8
_SIZES = 0.45, 1.8  # of the typical diameter: dots of several sizes
_SMALLER, _SMALLEST = 0.6, 3.0  # diameters at which smaller dots are searched, too; px, none smaller
_AS_MANY = 0.9  # of the dots, from which the likelihood fit takes over
_LOST_SHARE = 0.6  # of the dots at the last measurement; with fewer, everything is measured anew
_ROUND = 0.9, 5  # of the correlation with a disc that all but so many percent of the fitted dots have: least of one that was not fitted
_APART = 0.6  # diameters: dots do not overlap by more
_ROUNDS = 3  # of centroids, each in a window about the last
_INSIDE, _GROUND = 0.65, (0.6, 0.9)  # diameters from a dot's middle: radius of that window, and of the ring of ground around it
_UNSURE = 0.01  # of the diameter, standard deviation of a centroid: worn dots have 0.003 from frame to frame, and jumps of 0.03


class AutoDetector:
    """Dots of any polarity and size; sign: 1 for bright dots, -1 for dark ones, 0 for those that the first image has; make_fit: (sign,
    Look) -> an exact detector with detect_all(image) -> Dots."""

    def __init__(self, sign: int, make_fit: Callable):
        self._signs, self._make_fit = (sign,) if sign else (-1, 1), make_fit
        self._kind: Kind | None = None
        self._fit, self._count, self._diameter = None, 0, 0.0

    @property
    def found(self) -> str:
        """'165 bright dots of 9 px'; '' before the first image."""
        if self._kind is None:
            return ''
        return f'{self._count} {"bright" if self._kind.sign > 0 else "dark"} dots of {self._diameter:.0f} px'

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one checked uint8 image. Raises BadFrame with fewer than six."""
        dots = self._find(image, self._kind, self._fit) if self._kind is not None else ()
        if self._kind is None or len(dots) < _LOST_SHARE * self._count:
            dots = self._measure(image, dots)
        if len(dots) < FEWEST:
            raise BadFrame('too few dots found in the frame: check light, focus and the parameter polarity')
        return dots

    @staticmethod
    def _find(image, kind, fit=None, fitted=None) -> Dots:
        """Dots of that kind that are alike: by the fit, and discs that it leaves out. fitted: what the fit found, if that is known."""
        grey = select_channel(image, kind.channel)
        if fit is None:
            dots = _discs(grey, kind)
            return _alike(dots, dots, grey, kind.sign, _ALIKE[1])
        fitted = fit.detect_all(image) if fitted is None else fitted
        dots = _alike(fitted, fitted, grey, kind.sign, _ALIKE[1])
        left_out = _alike(_left_out(dots, fit.candidates, grey, kind), dots, grey, kind.sign, _ALIKE[0])
        return _joined([dots, left_out], [1.0, 0.0], kind.diameter)

    def _measure(self, image, before) -> Dots:
        """Measure what dots there are, and take it where it finds more than what is known did. Raises BadFrame without dots."""
        try:
            kind = find_kind(image, self._signs)
        except BadFrame:
            if self._kind is None:
                raise
            return before
        dots = self._find(image, kind)
        if len(dots) < max(FEWEST, len(before)):
            return before
        fit, kind = self._fit_of(image, kind, dots), replace(kind, lowest=LOWER * kind.lowest)
        fitted = fit.detect_all(image) if fit is not None else ()
        if len(fitted) < _AS_MANY * len(dots):
            fit = None
        dots = self._find(image, kind, fit, fitted)
        self._diameter = float(np.sqrt(4 / np.pi * np.median(dots.area)))
        self._kind, self._fit, self._count = replace(kind, diameter=self._diameter, peaks=None), fit, len(dots)
        return dots

    def _fit_of(self, image, kind, dots):
        """An exact detector of dots like these; None where their appearance cannot be measured."""
        try:
            return self._make_fit(kind.sign, describe_dots(select_channel(image, kind.channel), dots.uv, kind))
        except BadFrame:
            return None


def _discs(grey, kind) -> Dots:
    """Discs of about a diameter, of several sizes where there are."""
    parts, scores = [], []
    for diameter in (_SMALLER * kind.diameter, kind.diameter):
        if diameter < _SMALLEST and diameter < kind.diameter:
            continue
        known = kind.peaks is not None and diameter == kind.diameter
        found = kind.peaks if known else find_peaks(grey, (kind.sign,), diameter)[kind.sign]
        disc = (found.correlation > kind.lowest) & (found.amplitude > LEAST)
        parts.append(place_dots(grey, kind.sign, found.uv[disc], diameter))
        scores.append(found.correlation[disc] * (1.1 if diameter == kind.diameter else 1.0))
    return _joined(parts, scores, kind.diameter)


def _left_out(dots, candidates, grey, kind) -> Dots:
    """Discs at those of the candidates (N, 2) px where there are no dots, as round as nearly all dots are."""
    if not len(dots):
        return dots
    candidates = candidates[scipy.spatial.cKDTree(dots.uv).query(candidates)[0] > _APART * kind.diameter]
    strong = _contrast(grey, kind.sign, candidates, np.full(len(candidates), kind.diameter)) > LEAST
    if not strong.any():
        return dots.take(slice(0))
    others = place_dots(grey, kind.sign, candidates[strong], kind.diameter)
    correlation = correlate(grey, kind.sign, np.concatenate([others.uv, dots.uv]), kind.diameter)
    return others.take(correlation[:len(others)] > _ROUND[0] * np.percentile(correlation[len(others):], _ROUND[1]))


def _joined(parts: list[Dots], scores: list, diameter: float) -> Dots:
    """All dots, of any two that are too close the one with the higher score."""
    uv, area, sigma = (np.concatenate([getattr(part, name) for part in parts]) for name in ('uv', 'area', 'sigma'))
    score = np.concatenate([np.broadcast_to(score, len(part)) for part, score in zip(parts, scores)])
    return Dots(uv, area, sigma).take(_without_doubles(uv, score, _APART * diameter))


def _alike(dots: Dots, others: Dots, grey, sign, least: float) -> Dots:
    """Those of dots whose size and contrast differ no more than the others' do, or by less than least, of the contrast's logarithm."""
    if len(others) < FEWEST or not len(dots):
        return dots
    tree, count = scipy.spatial.cKDTree(others.uv), min(_NEIGHBOURS + 1, len(others))

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
    good = np.abs(contrast - local) < max(_DEVIATIONS * spread, least)
    return dots.take(good & (diameter > _SIZES[0] * typical) & (diameter < _SIZES[1] * typical))


def _contrast(grey, sign, uv, diameter):
    """(N,) grey levels, mean of nine places in each dot above the fourth highest of twelve around it: a rim goes through as many."""
    angle = np.r_[0, np.arange(8) * np.pi / 4, np.arange(12) * np.pi / 6]
    away = np.r_[0, np.full(8, 0.28), np.full(12, 0.8)]
    offset = away[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    column, row = (np.clip(np.rint(place[:, None] + diameter[:, None] * off), 0, most - 1).astype(int)
                   for place, off, most in zip(uv.T, offset.T, grey.shape[::-1]))
    levels = sign * grey[row, column].astype(float)
    return levels[:, :9].mean(axis=1) - np.partition(levels[:, 9:], 8, axis=1)[:, 8]


def _without_doubles(uv: np.ndarray, score: np.ndarray, apart: float) -> np.ndarray:
    """(N,) bool: without the lower score (N,) of any two positions uv (N, 2) px closer than apart, px."""
    kept = np.ones(len(uv), bool)
    for a, b in scipy.spatial.cKDTree(uv).query_pairs(apart, output_type='ndarray'):
        if kept[a] and kept[b]:
            kept[a if score[a] < score[b] else b] = False
    return kept


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
    ring, disc = (far > _GROUND[0] * diameter) & (far < _GROUND[1] * diameter), far < _INSIDE * diameter + 1.5

    def pixels(middle, some):
        """(N, P) of those about each of middle (N, 2)."""
        return padded[middle[:, 1, None] + half + y[some], middle[:, 0, None] + half + x[some]]
    place = np.array(uv, float)
    ground = np.median(pixels(np.clip(np.rint(place).astype(int), 0, most), ring), axis=1)[:, None]
    for _ in range(_ROUNDS):
        middle = np.clip(np.rint(place).astype(int), 0, most)
        off = (place - middle).astype(np.float32)
        away = np.hypot(x[disc].astype(np.float32) - off[:, :1], y[disc].astype(np.float32) - off[:, 1:])
        weight = np.maximum(pixels(middle, disc) - ground, 0) * np.clip(_INSIDE * diameter + 0.5 - away, 0, 1)
        total = np.maximum(weight.sum(axis=1), 1e-3)
        place = middle + np.stack([weight @ x[disc], weight @ y[disc]], axis=1) / total[:, None]
    level = np.maximum((weight**2).sum(axis=1) / total, 1.0)[:, None]
    return Dots(place, np.maximum(np.minimum(weight / level, 1).sum(axis=1), 1.0), np.full(len(place), _UNSURE * diameter))
