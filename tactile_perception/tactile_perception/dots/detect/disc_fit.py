# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Subpixel positions of worn discs: robust fit of a soft-edged disc on sloping ground (Gauss-Newton with Tukey's biweight, which rejects
missing ink and dirt)."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ...common.dots import Dots
from .disc_correlation import RING, SIZE, shrunk

_STEPS = 8  # iterations at most. Chosen
_SETTLED = 0.01  # px of the small image, median step at convergence. Chosen: a third of _MODEL
_EDGE = 0.9  # px of the small image, half width of the soft edge. Chosen: slightly over that of an averaged sharp edge
_TUKEY = 3.0  # standard deviations beyond which a pixel has no weight. Chosen: below the usual 4.685, as wear is common
_SPREAD = 0.1  # relative standard deviation of diameters, prior. Chosen: print and pressing
_TEXTURE = 15.0  # correlated pixels of texture, by which the prior's weight is multiplied. Chosen
_FARTHEST = 0.45  # radii, bound of the shift from the detection. Chosen
_SMALLEST, _LARGEST = 0.6, 1.5  # bounds of the radius over the typical one. Chosen
_BLOCK = 1.5  # radii, side of the block over which residuals of wear correlate. Chosen
_RIDGE = 1e-3  # grey levels squared per unit squared: keeps flat patches solvable
_UNSEEN = 1.6  # factor of the standard deviation: chips shift an edge without residual (measured on simulated wear of all degrees)
_MODEL = 0.03  # px of the small image, error of the edge model. Chosen


@dataclass
class _Patches:
    """values (N, P): grey levels at pixels x, y (P,) from integer positions corner (N, 2), px of an image scale (2,) times the full one."""

    values: np.ndarray
    x: np.ndarray
    y: np.ndarray
    corner: np.ndarray
    scale: np.ndarray

    @property
    def side(self) -> int:
        """px."""
        return int(round(np.sqrt(len(self.x))))


def fit_discs(grey: np.ndarray, sign: int, uv: np.ndarray, diameter: float) -> Dots:
    """Dots of an image (H, W) uint8, fitted from positions uv (N, 2) px of discs of about that diameter, px; sign: 1 for bright, -1 for
    dark."""
    small, scale = shrunk(grey, min(1.0, SIZE / diameter))
    radius = diameter * float(scale.mean()) / 2
    found = (uv + 0.5) * scale - 0.5
    patches = _cut(small * sign, found, radius, scale)
    off = (found - patches.corner).astype(np.float32)
    fit = _Fit(patches, off, radius)
    for _ in range(_STEPS):
        if fit.step() < _SETTLED:
            break
    place = (patches.corner + fit.off + 0.5) / scale - 0.5
    size = float(scale.mean())
    return Dots(place.astype(float), (np.pi * (fit.radius / size)**2).astype(float), fit.sigma() / size)


def _cut(image, found, radius, scale) -> _Patches:
    half = int(np.ceil(RING * radius + 2))
    padded = cv2.copyMakeBorder(image, half, half, half, half, cv2.BORDER_REPLICATE)
    corner = np.clip(np.rint(found), 0, [image.shape[1] - 1, image.shape[0] - 1]).astype(int)
    values = sliding_window_view(padded, (2 * half + 1, 2 * half + 1))[corner[:, 1], corner[:, 0]].reshape(len(found), -1)
    y, x = np.mgrid[-half:half + 1, -half:half + 1].reshape(2, -1).astype(np.float32)
    return _Patches(values, x, y, corner, scale)


class _Fit:
    """State of the fit: off (N, 2) px from the patches' corners, and radius (N,) px."""

    def __init__(self, patches: _Patches, off: np.ndarray, radius: float):
        self._patches, self._start, self._unit = patches, off.copy(), radius
        self.off, self.radius = off, np.full(len(off), radius, np.float32)

    def step(self) -> float:
        """One Gauss-Newton step; returns the median shift, px."""
        columns, window = self._model()
        values = self._patches.values[..., None]
        level = columns[..., :4]
        shape = np.linalg.solve(_square(level, window), level.transpose(0, 2, 1) @ (window[..., None] * values))
        rest = (values - level @ shape)[..., 0]
        self._raw = np.maximum((window * rest**2).sum(axis=1) / np.maximum(window.sum(axis=1) - 7, 1), 1e-6)
        weight = window * np.clip(1 - rest**2 / (_TUKEY**2 * self._raw[:, None]), 0, 1)**2
        columns[..., 4:] *= np.maximum(np.abs(shape[:, 3]), 1e-3)[:, None]
        self._matrix, right = _square(columns, weight), columns.transpose(0, 2, 1) @ (weight * rest)[..., None]
        prior = _TEXTURE * self._raw / (_SPREAD * self._unit)**2
        self._matrix[:, 6, 6] += prior
        right[:, 6, 0] += prior * (np.median(self.radius) - self.radius)
        self._rest = rest * (window > 0.5)
        self._seen = window > 0.5
        return self._advance(np.linalg.solve(self._matrix, right)[:, 4:, 0])

    def _model(self):
        """Columns (N, P, 7): ground, its slopes, disc, and the disc's derivatives by position and radius; window (N, P) of disc and
        ring."""
        x, y = self._patches.x - self.off[:, :1], self._patches.y - self.off[:, 1:]
        away = np.sqrt(x * x + y * y) + np.float32(1e-3)
        up = np.clip((self.radius[:, None] - away) / (2 * _EDGE) + 0.5, 0, 1)
        edge = 6 * up * (1 - up) / (2 * _EDGE)
        parts = np.ones_like(x), x / self._unit, y / self._unit, up * up * (3 - 2 * up), edge * x / away, edge * y / away, edge
        window = np.clip(RING * np.median(self.radius) + 0.5 - away, 0, 1)
        return np.stack(parts, axis=2), window.astype(np.float32)

    def _advance(self, step) -> float:
        reach = _FARTHEST * self._unit
        before, self.off = self.off, np.clip(self.off + np.clip(step[:, :2], -1, 1) - self._start, -reach, reach) + self._start
        larger = np.clip(step[:, 2], -0.15 * self._unit, 0.15 * self._unit)
        self.radius = np.clip(self.radius + larger, _SMALLEST * self._unit, _LARGEST * self._unit)
        return float(np.median(np.hypot(*(self.off - before).T)))

    def sigma(self) -> np.ndarray:
        """(N,) px of the small image: standard deviation of a position per axis, with the correlation of residuals between pixels."""
        covariance = np.linalg.inv(self._matrix)
        own = self._raw * (covariance[:, 4, 4] + covariance[:, 5, 5]) / 2
        return np.sqrt(_UNSEEN**2 * np.maximum(own, 0) * self._correlated_pixels() + _MODEL**2)

    def _correlated_pixels(self) -> float:
        """Number of correlated pixels: variance of block sums of residuals over that of independent ones."""
        side, block = self._patches.side, 2 * int(_BLOCK * self._unit / 2) + 1
        ratios = []
        for rest, seen, raw in zip(self._rest[::4], self._seen[::4], self._raw[::4]):
            sums, counts = (cv2.boxFilter(part.reshape(side, side).astype(np.float32), -1, (block, block), normalize=False,
                                          borderType=cv2.BORDER_CONSTANT) for part in (rest, seen))
            ratios.append((sums**2).sum() / (counts.sum() * raw))
        return max(float(np.median(ratios)), 1.0)


def _square(columns, weight):
    """(N, k, k) weighted products of columns (N, P, k), with a ridge."""
    square = (columns * weight[..., None]).transpose(0, 2, 1) @ columns
    k = square.shape[1]
    square[:, np.arange(k), np.arange(k)] += _RIDGE
    return square
