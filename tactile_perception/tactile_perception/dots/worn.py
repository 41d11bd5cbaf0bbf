# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Detector of worn, speckled or textured markers from about 7 px, in any arrangement, as whole discs.

A threshold fragments a speckled disc; a filter of its size averages the speckles. So discs are peaks of the normalised correlation with a
disc on a ring of ground (Lewis, Fast normalized cross-correlation, 1995), at the scale at which they explain most of the image's variance
(in the spirit of Lindeberg's scale selection, 1998). Each is then fitted by Gauss-Newton steps with Tukey's biweight, which rejects
missing ink and dirt.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
import scipy

from ..common.dots import Dots
from ..errors import BadFrame
from .fit import CHANNELS, select_channel

_SIZE = 11.0  # px, diameter of a disc in the filtered image: averages speckles, keeps positions within a pixel
_SCANNED = 9.0  # px, diameter of a disc in the images of the scale search
_DIAMETERS = 6.0 * 1.12 ** np.arange(20)  # px, from the smallest disc that is no dot to 52
_RING = 1.4  # outer diameter of the ring over that of the disc: excludes neighbours down to a pitch of 1.2 diameters
_CORRELATED = 0.45  # least correlation: twice that of pixel noise, two thirds of that of a disc with half of its ink
_NOISE = 1.0  # grey levels, regularises the normalisation of flat regions
_APART = 0.8  # diameters, least distance of two peaks
_LINE = 0.6  # of a peak's correlation, a radius off on both sides: streaks of light keep more, 99 of 100 worn discs less (measured)
_TOO_WIDE = 1.15  # diameter of the filter with the best response over that of the disc, because of the blurred edge (measured)
_LOST_SHARE = 0.6  # of the discs at the last measurement of the appearance; with fewer, it is measured anew
_NEIGHBOURS = 8  # discs whose median amplitude is the local reference, since light varies over the image
_FAINT = 0.45  # of the neighbours' amplitude, least of a disc; less is dirt or a fold
_UNLIKE = 0.68  # of the typical correlation, least of a disc
_FEWEST = 4  # discs
_DOUBLE = 0.7  # diameters within which the weaker of two detections is a duplicate

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
class _Appearance:
    """channel: in CHANNELS; diameter: px; count: of discs."""

    channel: str
    diameter: float
    count: int


@dataclass
class Peaks:
    """Discs: uv (N, 2) px; correlation (N,), 0 to 1; amplitude (N,): grey levels of disc over ring."""

    uv: np.ndarray
    correlation: np.ndarray
    amplitude: np.ndarray

    def __len__(self) -> int:
        return len(self.uv)


class DiscDetector:
    """Discs by normalised correlation at their own scale; sign: 1 for bright ones, -1 for dark. Channel and scale are measured in the
    first frame, and again when many discs are lost."""

    def __init__(self, sign: int):
        self._sign = sign
        self._appearance: _Appearance | None = None

    def detect(self, image: np.ndarray) -> Dots:
        """Discs of one checked uint8 image. Raises BadFrame with fewer than four."""
        dots = None if self._appearance is None else self._find(image)
        if dots is None or len(dots) < _LOST_SHARE * self._appearance.count:
            self._appearance = self._measure_appearance(image)
            dots = self._find(image)
            self._appearance.count = len(dots)
        if len(dots) < _FEWEST:
            raise BadFrame('fewer than four discs found in the frame: check light, focus and the parameter polarity')
        return dots

    def _find(self, image) -> Dots:
        grey, diameter = select_channel(image, self._appearance.channel), self._appearance.diameter
        found = find_discs(grey, self._sign, diameter)
        kept = _strong(found)
        if not kept.any():
            return Dots(np.zeros((0, 2)), np.zeros(0), np.zeros(0))
        dots = fit_discs(grey, self._sign, found.uv[kept], diameter / _TOO_WIDE)
        single = without_doubles(dots.uv, found.correlation[kept], _DOUBLE * diameter / _TOO_WIDE)
        return Dots(dots.uv[single], dots.area[single], dots.sigma[single])

    def _measure_appearance(self, image) -> _Appearance:
        """Scale from the grey image, or from the first channel that shows discs; then the channel with the clearest discs."""
        channels = CHANNELS if image.ndim == 3 else CHANNELS[-1:]
        planes = {channel: select_channel(image, channel) for channel in channels}
        for channel in reversed(channels):
            diameter = measure_diameter(planes[channel], self._sign)
            if np.isfinite(diameter):
                best = max(channels, key=lambda name: _clearness(find_discs(planes[name], self._sign, diameter), diameter))
                return _Appearance(best, diameter, 0)
        kind = 'bright' if self._sign > 0 else 'dark'
        raise BadFrame(f'no {kind} discs found in the frame: check light, focus and the parameter polarity')


def measure_diameter(grey: np.ndarray, sign: int) -> float:
    """Diameter, px, of the discs that explain most of an image (H, W) uint8; NaN where there are no four alike."""
    explained = np.zeros(len(_DIAMETERS))
    for k, diameter in enumerate(_DIAMETERS):
        if _RING * diameter < min(grey.shape):
            explained[k] = _explained_energy(find_discs(grey, sign, diameter, _SCANNED), diameter)
    best = int(explained.argmax())
    return float(_DIAMETERS[best]) if explained[best] > 0 else np.nan


def find_discs(grey: np.ndarray, sign: int, diameter: float, size: float = _SIZE) -> Peaks:
    """Peaks of the correlation of an image (H, W) uint8 with a disc of this diameter, px.

    sign: 1 for bright discs, -1 for dark ones; size: px across a disc in the image that is filtered, at most as in grey.
    """
    small, scale = _shrunk(grey, sign, min(1.0, size / diameter))
    across = diameter * float(scale.mean())
    correlation, amplitude = _correlated(small, round(across, 2))
    reach, margin = int(_APART * across / 2), int(np.ceil(across / 2 - 0.5))
    highest = cv2.dilate(correlation, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1)))
    inside = np.s_[margin:correlation.shape[0] - margin, margin:correlation.shape[1] - margin]
    row, column = np.nonzero((correlation[inside] >= highest[inside]) & (correlation[inside] > _CORRELATED)) + np.array([[margin]] * 2)
    disc = _has_ends(correlation, row, column, across / 2)
    row, column = row[disc], column[disc]
    uv = (np.stack([column, row], axis=1) + 0.5) / scale - 0.5
    return Peaks(uv, np.minimum(correlation[row, column], 0.999).astype(float), amplitude[row, column].astype(float))


def _shrunk(grey, sign, factor) -> tuple[np.ndarray, np.ndarray]:
    """Image (H, W) uint8 reduced by a factor up to 1 to (h, w) float32 with bright discs, and the exact factors (2,) along u and v after
    rounding of the size."""
    size = max(round(grey.shape[1] * factor), 1), max(round(grey.shape[0] * factor), 1)
    small = cv2.resize(grey, size, interpolation=cv2.INTER_AREA) if factor < 1 else grey
    return small.astype(np.float32) * sign, np.array([small.shape[1] / grey.shape[1], small.shape[0] / grey.shape[0]])


def _correlated(image, across) -> tuple[np.ndarray, np.ndarray]:
    """Normalised correlation and amplitude (H, W) of a disc, px across, on a ring of ground, around each pixel of an image (H, W)."""
    disc, both = _template(across)
    image = image - image.mean()
    ink, total = disc.sum(), both.sum()
    contrast = disc - both * (ink / total)
    norm = float((contrast**2).sum())
    product, plain, square = (cv2.filter2D(values, cv2.CV_32F, kernel, borderType=cv2.BORDER_REFLECT)
                              for values, kernel in ((image, contrast), (image, both), (image * image, both)))
    variance = np.maximum(square - plain * plain / total, 0) + total * _NOISE**2
    return product / np.sqrt(variance * norm), product / norm


@lru_cache(maxsize=64)
def _template(across: float) -> tuple[np.ndarray, np.ndarray]:
    """(n, n) float32 share of each pixel inside a disc, px across, and inside disc and ring."""
    half, fine = int(np.ceil(_RING * across / 2 + 0.5)), 8
    at = (np.arange((2 * half + 1) * fine) + 0.5) / fine - half - 0.5
    away = np.hypot(at[:, None], at)
    blocks = 2 * half + 1, fine, 2 * half + 1, fine
    return tuple((away < radius).reshape(blocks).mean(axis=(1, 3)).astype(np.float32) for radius in (across / 2, _RING * across / 2))


def correlate_patches(image: np.ndarray, column: np.ndarray, row: np.ndarray, across: float) -> tuple[np.ndarray, np.ndarray]:
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


def _has_ends(correlation, row, column, radius) -> np.ndarray:
    """(N,) bool: the correlation has fallen a radius away, on one side at least of each of eight axes through a peak."""
    angle = np.arange(8) * np.pi / 8
    across, down = np.rint(radius * np.cos(angle)).astype(int), np.rint(radius * np.sin(angle)).astype(int)
    ends = [correlation[np.clip(row[:, None] + side * down, 0, correlation.shape[0] - 1),
                        np.clip(column[:, None] + side * across, 0, correlation.shape[1] - 1)] for side in (1, -1)]
    return (np.minimum(*ends) < _LINE * correlation[row, column, None]).all(axis=1)


def _explained_energy(found: Peaks, diameter: float) -> float:
    """Squared grey levels times px^2 of an image that discs of this diameter, px, explain; of a brighter one no more than of most: a lamp's
    reflection is no disc."""
    if len(found) < _FEWEST:
        return 0.0
    amplitude = np.clip(found.amplitude, 0, np.median(found.amplitude))
    return float((amplitude**2 * found.correlation**2).sum() * diameter**2)


def _clearness(found: Peaks, diameter: float) -> float:
    """Explained energy normalised by the contrast, independent of the channel's gain."""
    energy = _explained_energy(found, diameter)
    return energy / np.median(found.amplitude)**2 if energy > 0 else 0.0


def _strong(found: Peaks) -> np.ndarray:
    """(N,) bool: amplitude near that of the neighbours, and correlation near the typical one."""
    if len(found) < 2:
        return np.ones(len(found), bool)
    near = scipy.spatial.cKDTree(found.uv).query(found.uv, min(_NEIGHBOURS + 1, len(found)))[1]
    strong = found.amplitude > _FAINT * np.median(found.amplitude[near], axis=1)
    return strong & (found.correlation > _UNLIKE * np.median(found.correlation[strong]))


def without_doubles(uv: np.ndarray, score: np.ndarray, apart: float) -> np.ndarray:
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
