# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots of a sensor that nobody described: polarity, channel and size are measured in the first image.

A dot is one of many alike. At each scale, peaks of the difference of two Gaussians (Lindeberg, Feature detection with automatic scale
selection, 1998) that correlate with a disc on a ring of ground (Lewis, Fast normalized cross-correlation, 1995) count by their contrast,
but none for more than most: a lamp, a rim or a letter is one of few, and its brightness counts for nothing. The scale and the sign with
the most contrast win. Where the likelihood fit finds as many, it places the dots. Else each disc is fitted by Gauss-Newton steps with
Tukey's biweight, which rejects missing ink and dirt: worn, speckled or textured markers are placed as whole discs.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
import scipy

from ..common.dots import Dots
from ..errors import BadFrame
from .fit import CHANNELS, describe_dots, select_channel

_DIAMETERS = 3.0 * 2 ** (np.arange(19) / 4)  # px, of the scale search: up to 68; four to an octave, where the response falls by 5 %
_ACROSS = 7.0  # px, diameter of a disc in the reduced images: the fewest in which its edge is seen on all sides
_MOST = 1500  # strongest peaks at a scale that are looked at: bounds the time
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
_SIZE = 11.0  # px, diameter of a disc in the image in which it is fitted: averages speckles
_RING = 1.4  # outer diameter of the ring over that of the disc: excludes neighbours down to a pitch of 1.2 diameters
_NOISE = 1.0  # grey levels, regularises the normalisation of flat regions

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


@dataclass
class Peaks:
    """Discs: uv (N, 2) px; correlation (N,), 0 to 1; amplitude (N,): grey levels of disc over ring."""

    uv: np.ndarray
    correlation: np.ndarray
    amplitude: np.ndarray


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
    kept = _without_doubles(uv, np.concatenate(scores), 0.6 * diameter)
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
        correlation, amplitude = _correlate_patches(small * sign, column, row, across)
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


@lru_cache(maxsize=64)
def _template(across: float) -> tuple[np.ndarray, np.ndarray]:
    """(n, n) float32 share of each pixel inside a disc, px across, and inside disc and ring."""
    half, fine = int(np.ceil(_RING * across / 2 + 0.5)), 8
    at = (np.arange((2 * half + 1) * fine) + 0.5) / fine - half - 0.5
    away = np.hypot(at[:, None], at)
    blocks = 2 * half + 1, fine, 2 * half + 1, fine
    return tuple((away < radius).reshape(blocks).mean(axis=(1, 3)).astype(np.float32) for radius in (across / 2, _RING * across / 2))


def _correlate_patches(image: np.ndarray, column: np.ndarray, row: np.ndarray, across: float) -> tuple[np.ndarray, np.ndarray]:
    """Normalised correlation and amplitude (N,) of a disc, px across, on a ring of ground, at pixels of an image (H, W) float32."""
    disc, both = _template(round(across, 2))
    half = len(disc) // 2
    padded = cv2.copyMakeBorder(image, half, half, half, half, cv2.BORDER_REFLECT)
    windows = np.lib.stride_tricks.sliding_window_view(padded, disc.shape)
    patches = windows[row, column].reshape(len(row), disc.size)
    contrast, weight = (disc - both * (disc.sum() / both.sum())).ravel(), both.ravel()
    product, norm = patches @ contrast, float((contrast**2).sum())
    mean = patches @ weight / weight.sum()
    variance = np.maximum((patches - mean[:, None])**2 @ weight, 0) + weight.sum() * _NOISE**2
    return product / np.sqrt(variance * norm), product / norm


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
    half = int(np.ceil(_RING * unit + 2))
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
    window = np.clip(_RING * typical + 0.5 - away, 0, 1)
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
