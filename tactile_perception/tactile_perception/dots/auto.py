# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots of a sensor that nobody described: polarity, channel and size are measured in the first image.

A dot is one of many alike. At each scale, peaks of the difference of two Gaussians (Lindeberg, Feature detection with automatic scale
selection, 1998) that correlate with a disc on a ring of ground count by their contrast, but none for more than most: a lamp, a rim or a
letter is one of few, and its brightness counts for nothing. The scale and the sign with the most contrast win. Where the likelihood fit
finds as many, it places the dots; else the discs' own fit does.
"""
from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import scipy

from ..common.dots import Dots
from ..errors import BadFrame
from .fit import CHANNELS, describe_dots, select_channel
from .worn import Peaks, correlate_patches, fit_discs, without_doubles

_DIAMETERS = 3.0 * 2 ** (np.arange(19) / 4)  # px, of the scale search: up to 68; four to an octave, where the response falls by 5 %
_ACROSS = 7.0  # px, diameter of a disc in the reduced images: the fewest in which its edge is seen on all sides
_MOST = 1500  # strongest peaks at a scale that are looked at: bounds the time
_NOISE = 4.0  # standard deviations of pixel noise, least contrast of a peak's pixel
_LEAST = 6.0  # grey levels, least contrast: print and light, not rounding
_CORRELATED = 0.5, 0.62, 0.74, 0.84, 0.92  # candidates of the least correlation with a disc: worn dots have 0.6, texture seldom 0.8
_ALIKE = 0.4, 2.2  # of the neighbours' contrast: light varies by less from dot to dot, lamps have more
_NEIGHBOURS = 8
_SIZES = 0.45, 1.8  # of the typical diameter: dots of several sizes
_MANY = 30  # dots: sensors have as many; of lamps, screws and letters of one size there are fewer
_FEWEST = 6  # dots: the corners of a square are four
_AS_MANY = 0.9  # of the dots, from which the likelihood fit takes over
_LOWER = 0.8  # times the least correlation that tells dots from others: where dots differ, as worn ones do, some have less
_LOST_SHARE = 0.6  # of the dots at the last measurement; with fewer, everything is measured anew


class AutoDetector:
    """Dots of any polarity and size; sign: 1 for bright dots, -1 for dark ones, 0 for those that the first image has; make_fit: (sign,
    Look) -> an exact detector with detect_all(image) -> Dots."""

    def __init__(self, sign: int, make_fit: Callable):
        self._signs, self._make_fit = (sign,) if sign else (-1, 1), make_fit
        self._kind: tuple[int, str, float, float] | None = None  # sign, channel, diameter, least correlation
        self._fit, self._count = None, 0

    @property
    def found(self) -> str:
        """'165 bright dots of 9 px'; '' before the first image."""
        if self._kind is None:
            return ''
        sign, _, diameter, _ = self._kind
        return f'{self._count} {"bright" if sign > 0 else "dark"} dots of {diameter:.0f} px'

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one checked uint8 image. Raises BadFrame with fewer than six."""
        dots = self._find(image) if self._kind is not None else ()
        if self._kind is None or len(dots) < _LOST_SHARE * self._count:
            dots = self._measure(image, dots)
        if len(dots) < _FEWEST:
            raise BadFrame('too few dots found in the frame: check light and focus')
        return dots

    def _find(self, image) -> Dots:
        sign, channel, diameter, lowest = self._kind
        grey = select_channel(image, channel)
        if self._fit is not None:
            return _alike(self._fit.detect_all(image), grey, sign)
        return _alike(_discs(grey, sign, diameter, lowest), grey, sign)

    def _measure(self, image, before) -> Dots:
        """Measure what dots there are, and take it where it finds more than what is known did. Raises BadFrame without dots."""
        kind = _measure_kind(image, self._signs)
        if kind is None:
            if self._kind is None:
                raise BadFrame('no dots found in the frame: check light and focus; a dot is one of many alike')
            return before
        sign, channel, diameter, lowest = kind
        grey = select_channel(image, channel)
        dots = _alike(_discs(grey, sign, diameter, lowest), grey, sign)
        if len(dots) < max(_FEWEST, len(before)):
            return before
        fit = self._fit_of(grey, channel, sign, dots)
        exact = _alike(fit.detect_all(image), grey, sign) if fit is not None else ()
        if len(exact) >= _AS_MANY * len(dots):
            dots = exact
        else:
            fit, lowest = None, _LOWER * lowest
            dots = _alike(_discs(grey, sign, diameter, lowest), grey, sign)
        self._kind, self._fit = (sign, channel, float(np.sqrt(4 / np.pi * np.median(dots.area))), lowest), fit
        self._count = len(dots)
        return dots

    def _fit_of(self, grey, channel, sign, dots):
        """An exact detector of dots like these; None where their appearance cannot be measured."""
        try:
            return self._make_fit(sign, describe_dots(channel, grey, dots.uv, np.sqrt(4 / np.pi * dots.area), sign))
        except BadFrame:
            return None


def _measure_kind(image, signs) -> tuple[int, str, float, float] | None:
    """(sign, channel, diameter px, least correlation) of the dots that explain most of an image, None without any.

    Every second scale of the grey image comes first, and its neighbours in all channels then; colours are looked through alone where grey
    shows nothing.
    """
    diameters = _DIAMETERS[3 * _DIAMETERS < min(image.shape[:2])]
    channels = CHANNELS if image.ndim == 3 and _coloured(image) else CHANNELS[-1:]
    found = (_best_kind(image, CHANNELS[-1:], signs, diameters[::2])
             or _best_kind(image, [name for name in channels if name != CHANNELS[-1]], signs, diameters[::2]))
    if found is None:
        return None
    near = np.abs(np.log2(diameters / found[2])) < 0.3
    return _best_kind(image, channels, (found[0],), diameters[near])


def _best_kind(image, channels, signs, diameters) -> tuple[int, str, float, float] | None:
    scores = {}
    for channel in channels:
        grey = select_channel(image, channel)
        for diameter in diameters.tolist():
            for sign, peaks in _peaks(grey, signs, diameter).items():
                scores |= {(sign, channel, diameter, lowest): _explained(peaks, diameter, lowest) for lowest in _CORRELATED}
    best = max(scores, key=scores.get, default=None)
    return best if best is not None and scores[best] > 0 else None


def _coloured(image) -> bool:
    part = image[::8, ::8].astype(np.int16)
    return bool(np.percentile(np.ptp(part, axis=2), 90) > 12)  # grey levels, over noise and white balance


def _explained(found: Peaks, diameter: float, lowest: float) -> float:
    """Contrast that dots of this diameter, px, explain, of each no more than of most, by how alike and how many they are."""
    disc = found.correlation > lowest
    if disc.sum() < _FEWEST:
        return 0.0
    typical = np.median(found.amplitude[disc])
    alike = np.mean((found.amplitude[disc] > 0.5 * typical) & (found.amplitude[disc] < 2 * typical))
    many = min(1.0, disc.sum() / _MANY)
    return float((np.minimum(found.amplitude[disc], typical)**2 * found.correlation[disc]**8).sum() * (diameter * alike * many)**2)


def _discs(grey, sign, diameter, lowest) -> Dots:
    """Discs of about a diameter, px, of several sizes where there are."""
    parts, scores = [], []
    for factor in (0.6, 1.0):
        if factor * diameter < _DIAMETERS[0] and factor < 1:
            continue
        found = _peaks(grey, (sign,), factor * diameter)[sign]
        disc = found.correlation > lowest
        if disc.any():
            parts.append(fit_discs(grey, sign, found.uv[disc], factor * diameter))
            scores.append(found.correlation[disc] * (1.1 if factor == 1 else 1.0))
    if not parts:
        return Dots(np.zeros((0, 2)), np.zeros(0), np.zeros(0))
    uv, area, sigma = (np.concatenate([getattr(part, name) for part in parts]) for name in ('uv', 'area', 'sigma'))
    kept = without_doubles(uv, np.concatenate(scores), 0.6 * diameter)
    return Dots(uv[kept], area[kept], sigma[kept])


def _peaks(grey, signs, diameter) -> dict[int, Peaks]:
    """Discs of this diameter, px, by sign."""
    factor = min(1.0, _ACROSS / diameter)
    small = grey.astype(np.float32) if factor == 1 else cv2.resize(
        grey, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA).astype(np.float32)
    scale = np.array([small.shape[1] / grey.shape[1], small.shape[0] / grey.shape[0]])
    across = diameter * float(scale.mean())
    inner, outer = (cv2.GaussianBlur(small, (0, 0), s * across, borderType=cv2.BORDER_REFLECT) for s in (0.28, 0.5))
    relief = inner - outer
    reach = max(1, int(0.4 * across))
    noise = np.median(np.abs(relief[::3, ::3])) / 0.6745
    margin, found = int(np.ceil(across / 2)), {}
    square = np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)
    for sign in signs:
        rise = relief if sign > 0 else -relief
        is_peak = (rise >= cv2.dilate(rise, square)) & (rise > max(_LEAST / 4, noise))
        row, column = np.nonzero(is_peak[margin:-margin, margin:-margin])
        row, column = row + margin, column + margin
        if len(row) > _MOST:
            kept = np.argpartition(-rise[row, column], _MOST)[:_MOST]
            row, column = row[kept], column[kept]
        correlation, amplitude = correlate_patches(small * sign, column, row, across)
        good = (correlation > _CORRELATED[0]) & (amplitude > _LEAST)
        uv = (np.stack([column, row], axis=1)[good] + 0.5) / scale - 0.5
        found[sign] = Peaks(uv, correlation[good].astype(float), amplitude[good].astype(float))
    return found


def _alike(dots: Dots, grey, sign) -> Dots:
    """The dots whose size and contrast are those of most."""
    if len(dots) < _FEWEST:
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
