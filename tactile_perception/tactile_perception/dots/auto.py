# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots of a sensor that nobody described: look.py measures in the first image what they are. Where the likelihood fit finds as many, it
places the dots. Else they are worn, speckled or textured, and placed at their centroids.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy

from .. import _core
from ..common.dots import Dots
from ..errors import BadFrame
from .look import FEWEST, LOWER, Kind, describe_dots, find_kind, find_peaks, select_channel

_ALIKE = 0.4, 2.2  # of the neighbours' contrast: light varies by less from dot to dot, lamps have more
_NEIGHBOURS = 8
_SIZES = 0.45, 1.8  # of the typical diameter: dots of several sizes
_AS_MANY = 0.9  # of the dots, from which the likelihood fit takes over
_SMALLER, _SMALLEST = 0.6, 3.0  # diameters at which smaller dots are searched, too; px, none smaller
_LOST_SHARE = 0.6  # of the dots at the last measurement; with fewer, everything is measured anew


class AutoDetector:
    """Dots of any polarity and size; sign: 1 for bright dots, -1 for dark ones, 0 for those that the first image has; make_fit: (sign,
    Look) -> an exact detector with detect_all(image) -> Dots."""

    def __init__(self, sign: int, make_fit: Callable | None = None):
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
        smaller = _SMALLER * kind.diameter
        kind = replace(kind, smaller=smaller if smaller > _SMALLEST else 0.0)
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
        if fit is None and kind.smaller and len(self._find(image, replace(kind, smaller=0.0))) > len(dots) - FEWEST:
            kind = replace(kind, smaller=0.0)
        self._kind, self._fit, self._count = kind, fit, len(dots)
        return dots

    def _fit_of(self, image, kind, dots):
        """An exact detector of dots like these; None where their appearance cannot be measured."""
        if self._make_fit is None:
            return None
        try:
            return self._make_fit(kind.sign, describe_dots(select_channel(image, kind.channel), dots.uv, kind))
        except BadFrame:
            return None


def _discs(grey, kind) -> Dots:
    """Discs of about a diameter, and smaller ones where the kind has such."""
    sizes = [size for size in (kind.diameter, kind.smaller) if size]
    found = [find_peaks(grey, (kind.sign,), size)[kind.sign] for size in sizes]
    uv, score = np.concatenate([part.uv for part in found]), np.concatenate([part.correlation for part in found])
    size = np.repeat(sizes, [len(part.uv) for part in found])
    disc = np.flatnonzero(score > kind.lowest)
    disc = disc[_without_doubles(uv[disc], (score * np.where(size == kind.diameter, 1.1, 1.0))[disc], 0.6 * kind.diameter)]
    dots = [_core.dots.place_dots(grey, uv[disc][size[disc] == one], sign=kind.sign, diameter=one, noise=kind.noise) for one in sizes]
    return Dots(*(np.concatenate([getattr(part, name) for part in dots]) for name in ('uv', 'area', 'sigma')))


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
