# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots of a sensor that nobody described: look.py measures in the first image what they are. Where the likelihood fit finds as many, it
places the dots. Else each disc is fitted by Gauss-Newton steps with Tukey's biweight, which rejects missing ink and dirt: worn, speckled
or textured markers are placed as whole discs.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
import scipy

from ..common.dots import Dots
from ..errors import BadFrame
from .look import FEWEST, LOWER, RING, Kind, describe_dots, find_kind, find_peaks, select_channel

_ALIKE = 0.4, 2.2  # of the neighbours' contrast: light varies by less from dot to dot, lamps have more
_NEIGHBOURS = 8
_SIZES = 0.45, 1.8  # of the typical diameter: dots of several sizes
_SMALLER, _SMALLEST = 0.6, 3.0  # diameters at which smaller dots are searched, too; px, none smaller
_AS_MANY = 0.9  # of the dots, from which the likelihood fit takes over
_LOST_SHARE = 0.6  # of the dots at the last measurement; with fewer, everything is measured anew
_SIZE = 11.0  # px, diameter of a disc in the image in which it is fitted: averages speckles

_STEPS = 4  # of the fit
_EDGE = 0.9  # px, half width of the soft edge: slightly over that of an averaged sharp edge
_TUKEY = 3.0  # standard deviations beyond which a pixel has no weight: wear is common
_SPREAD = 0.1  # relative standard deviation of diameters, prior: print and pressing
_TEXTURE = 15.0  # correlated pixels of texture, by which the prior's weight and the variance of a position are multiplied
_FARTHEST = 0.45  # radii, bound of the shift from the detection
_RADII = 0.6, 1.5  # bounds of the radius over the typical one
_LONGEST, _LONGEST_SIZE = 1.0, 0.15  # px and typical radii, longest step
_RIDGE = 1e-3  # grey levels squared per unit squared: keeps flat patches solvable
_MODEL = 0.03  # px, error of the edge model



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
            raise BadFrame('too few dots found in the frame: check light and focus')
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
            parts.append(fit_discs(grey, kind.sign, found.uv[disc], diameter))
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


def fit_discs(grey: np.ndarray, sign: int, uv: np.ndarray, diameter: float) -> Dots:
    """Dots of an image (H, W) uint8, fitted from positions uv (N, 2) px of discs of about that diameter, px; sign: 1 for bright, -1 for
    dark. Unknown of each: ground, its two slopes, amplitude; position and radius."""
    small, scale = _shrunk(grey, sign, min(1.0, _SIZE / diameter))
    size = float(scale.mean())
    unit, at = diameter * size / 2, (uv + 0.5) * scale - 0.5
    half = int(np.ceil(RING * unit + 2))
    middle = np.clip(np.floor(at + 0.5), 0, np.array(small.shape[::-1]) - 1).astype(int)
    y, x = np.mgrid[-half:half + 1, -half:half + 1].reshape(2, -1).astype(np.float32)
    y, x = (side[np.hypot(x, y) <= half] for side in (y, x))
    padded = cv2.copyMakeBorder(small, half, half, half, half, cv2.BORDER_REPLICATE)
    pixels = padded[middle[:, 1, None] + (y + half).astype(int), middle[:, 0, None] + (x + half).astype(int)]
    start, radius = at - middle, np.full(len(uv), unit)
    place = start.copy()
    for _ in range(_STEPS):
        change, variance = _step(pixels, x - place[:, :1].astype(np.float32), y - place[:, 1:].astype(np.float32), radius, unit)
        place = start + np.clip(place + np.clip(change[:, :2], -_LONGEST, _LONGEST) - start, -_FARTHEST * unit, _FARTHEST * unit)
        radius = np.clip(radius + np.clip(change[:, 2], -_LONGEST_SIZE * unit, _LONGEST_SIZE * unit), *(unit * np.array(_RADII)))
    sigma = np.sqrt(_TEXTURE * variance + _MODEL**2)
    return Dots((middle + place + 0.5) / scale - 0.5, np.pi * (radius / size)**2, sigma / size)


def _shrunk(grey, sign, factor) -> tuple[np.ndarray, np.ndarray]:
    """Image (H, W) uint8 reduced by a factor up to 1 to (h, w) float32 with bright discs, and the exact factors (2,) along u and v after
    rounding of the size."""
    size = max(round(grey.shape[1] * factor), 1), max(round(grey.shape[0] * factor), 1)
    small = cv2.resize(grey, size, interpolation=cv2.INTER_AREA) if factor < 1 else grey
    return small.astype(np.float32) * sign, np.array([small.shape[1] / grey.shape[1], small.shape[0] / grey.shape[0]])


def _step(pixels, x, y, radius, unit) -> tuple[np.ndarray, np.ndarray]:
    """Changes (N, 3) of position and radius, px, and variances (N,) of a position by independent pixels, from pixels (N, P) at offsets x, y
    (N, P) from discs of radii (N,)."""
    typical = float(np.median(radius))
    away = np.hypot(x, y) + np.float32(1e-3)
    up = np.clip((radius[:, None].astype(np.float32) - away) / (2 * _EDGE) + 0.5, 0, 1)
    edge = 6 * up * (1 - up) / (2 * _EDGE)
    window = np.clip(RING * typical + 0.5 - away, 0, 1)
    levels = np.stack([np.ones_like(x), x / unit, y / unit, up * up * (3 - 2 * up)], axis=1)
    level = _solved(levels, window, pixels)[0]
    rest = pixels - (level[:, None].astype(np.float32) @ levels)[:, 0]
    noise = np.maximum((window * rest**2).sum(axis=1) / np.maximum(window.sum(axis=1) - 7, 1), 1e-6)
    weight = window * np.clip(1 - rest**2 / (_TUKEY**2 * noise)[:, None], 0, 1)**2
    amplitude = np.maximum(np.abs(level[:, 3]), 1e-3).astype(np.float32)[:, None]
    shifts = np.stack([edge * x / away * amplitude, edge * y / away * amplitude, edge * amplitude], axis=1)
    prior = _TEXTURE * noise / (_SPREAD * unit)**2
    change, inverse = _solved(np.concatenate([levels, shifts], axis=1), weight, rest, prior, prior * (typical - radius))
    return change[:, 4:], noise * (inverse[:, 4, 4] + inverse[:, 5, 5]) / 2


def _solved(columns, weight, values, prior=0.0, pull=0.0) -> tuple[np.ndarray, np.ndarray]:
    """Weighted least squares of values (N, P) by columns (N, K, P), with a prior of the last unknown: solutions (N, K), and inverses
    (N, K, K) of the normal equations."""
    weighted = columns * weight[:, None]
    matrix = (weighted @ columns.transpose(0, 2, 1)).astype(float) + _RIDGE * np.eye(columns.shape[1])
    right = (weighted @ values[:, :, None])[:, :, 0].astype(float)
    matrix[:, -1, -1] += prior
    right[:, -1] += pull
    inverse = np.linalg.inv(matrix)
    return (inverse @ right[:, :, None])[:, :, 0], inverse
