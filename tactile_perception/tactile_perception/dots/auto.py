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
from ..errors import BadFrame
from .look import FEWEST, LOWER, Kind, describe_dots, find_kind, find_peaks, select_channel

_ALIKE = 0.4, 2.2  # of the neighbours' contrast: light varies by less from dot to dot, lamps have more
_NEIGHBOURS = 8
_SIZES = 0.45, 1.8  # of the typical diameter: dots of several sizes
_SMALLER, _SMALLEST = 0.6, 3.0  # diameters at which smaller dots are searched, too; px, none smaller
_AS_MANY = 0.9  # of the dots, from which the likelihood fit takes over
_LOST_SHARE = 0.6  # of the dots at the last measurement; with fewer, everything is measured anew
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
    def _find(image, kind, fit=None) -> Dots:
        """Dots of that kind, by the fit or as discs, that are alike."""
        grey = select_channel(image, kind.channel)
        return _alike(_discs(grey, kind) if fit is None else fit.detect_all(image), grey, kind.sign)

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
        fit = self._fit_of(image, kind, dots)
        exact = self._find(image, kind, fit) if fit is not None else ()
        if len(exact) >= _AS_MANY * len(dots):
            dots = exact
        else:
            fit, kind = None, replace(kind, lowest=LOWER * kind.lowest)
            dots = self._find(image, kind)
        self._diameter = float(np.sqrt(4 / np.pi * np.median(dots.area)))
        self._kind, self._fit, self._count = replace(kind, diameter=self._diameter), fit, len(dots)
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
        found = find_peaks(grey, (kind.sign,), diameter)[kind.sign]
        disc = found.correlation > kind.lowest
        if disc.any():
            parts.append(place_dots(grey, kind.sign, found.uv[disc], diameter))
            scores.append(found.correlation[disc] * (1.1 if diameter == kind.diameter else 1.0))
    if not parts:
        return Dots(np.zeros((0, 2)), np.zeros(0), np.zeros(0))
    uv, area, sigma = (np.concatenate([getattr(part, name) for part in parts]) for name in ('uv', 'area', 'sigma'))
    kept = _without_doubles(uv, np.concatenate(scores), 0.6 * kind.diameter)
    return Dots(uv[kept], area[kept], sigma[kept])


def _alike(dots: Dots, grey, sign) -> Dots:
    """The dots whose size and contrast are those of most."""
    if len(dots) < FEWEST:
        return dots
    diameter = np.sqrt(4 / np.pi * dots.area)
    typical = np.median(diameter)
    contrast = _contrast(grey, dots.uv, diameter) * sign
    near = scipy.spatial.cKDTree(dots.uv).query(dots.uv, min(_NEIGHBOURS + 1, len(dots)))[1][:, 1:]
    usual = np.median(contrast[near], axis=1)
    usual = np.clip(usual, 0.5 * np.median(contrast), 2 * np.median(contrast))
    good = (contrast > _ALIKE[0] * usual) & (contrast < _ALIKE[1] * usual)
    good &= (diameter > _SIZES[0] * typical) & (diameter < _SIZES[1] * typical)
    return Dots(dots.uv[good], dots.area[good], dots.sigma[good])


def _contrast(grey, uv, diameter):
    """(N,) grey levels, mean of nine places in each dot minus the median of twelve around it."""
    angle = np.r_[0, np.arange(8) * np.pi / 4, np.arange(12) * np.pi / 6]
    away = np.r_[0, np.full(8, 0.28), np.full(12, 0.8)]
    offset = away[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    at = np.rint(uv[:, None] + diameter[:, None, None] * offset).astype(int)
    at = np.clip(at, 0, np.array(grey.shape[::-1]) - 1)
    levels = grey[at[..., 1], at[..., 0]].astype(float)
    return levels[:, :9].mean(axis=1) - np.median(levels[:, 9:], axis=1)


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
