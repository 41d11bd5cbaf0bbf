# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reference of the kernel fit_blobs: the same moments of whole patches, in NumPy."""
from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.lib.stride_tricks import as_strided
from tactile_perception.common.statistics import upper_median
from tactile_perception.dots.detect.blob_moments import Blobs

LOW, HIGH = 0.2, 0.8  # of the way from ground to plateau, between which a pixel's weight rises from 0 to 1. Chosen
_TURN = 0.8416  # standard deviations of the blur at which an edge reaches HIGH. Derived: normal quantile of HIGH
_WIDTH = 0.2673  # sum of w (1 - w) across a straight edge of weights w, per px of blur. Derived for a Gaussian edge
_EDGE = _TURN / (HIGH - LOW)  # px shift of an edge per relative change of brightness and px of blur. Derived
_EDGE_BLUR = 1.247  # reduction of that shift by blur, on sloping light. Derived for a Gaussian edge
_CAP = 1.7  # ramp units (the plateau is at 1.33), above which a pixel of the small image is glare. Chosen
_MODEL = 0.003  # px, error of a position by shapes and light that are not modelled. Chosen
_MODEL_OF_SHIFT = 0.1  # relative uncertainty of the correction for sloping light. Chosen
_MODEL_OF_SHAPE = 0.7  # radii of uncertainty per unit of missing solidity. Chosen
_FEWEST = 20  # px of plateau, for its slope. Chosen
_STEEPEST = 0.05  # per px, bound of the plateau's relative slope. Chosen
_TO_PLATEAU, _HALF_PIXEL = 2.0, 0.65  # blurs from edge to plateau, and px for the pixels of the small image. Chosen
_OTHER = 0.25  # of the amplitude, deviation from the ground level that excludes a sample. Chosen
_SOFT = 0.9  # loss of solidity by a soft edge, per square of blur over radius. Chosen
_RING = np.stack([np.cos(np.arange(12) * np.pi / 6), np.sin(np.arange(12) * np.pi / 6)], axis=1) / 2
_SCALE = np.vstack([_RING, np.array([(a, b) for a in range(-2, 3) for b in range(-2, 3) if abs(a) + abs(b) <= 3]) * 0.11]).T
# Sample positions of ground (_RING), then plateau, relative to a region's centre, in its width and height.
_OUTSIDE = 3.5  # px from a region's border to its samples of the ground. Chosen
_GROUND_RANK, _PLATEAU_RANK = 4, 12  # of the sorted samples: robust to neighbours on the ground, to glare and border on the plateau. Chosen


def fit_blobs(grey: np.ndarray, small: np.ndarray, step: int, regions) -> Blobs:
    """Bright markers of an image (H, W) uint8 in regions of the small image, reduced by step (1 or 2)."""
    ground, amplitude, ground_slope = _levels(small, regions, step)
    patches, coarse, corner = _patches(grey, small, regions, step)
    side = patches.shape[1]
    weight = _ramp(patches, ground, amplitude, 1)
    moments = _Moments(weight @ _basis(side, 1))
    blur = _blur(weight, moments)
    noise = _noise(patches) / amplitude
    slope, slope_noise = _plateau_slope(_ramp(coarse, ground, amplitude, _CAP), step, moments, blur, noise)
    shift = _shift(moments, blur, slope, ground_slope)
    solidity = moments.solidity * (1 + _SOFT * (blur * moments.perimeter / (2 * moments.area))**2)
    model = np.sqrt(_MODEL**2 + ((_MODEL_OF_SHIFT * shift)**2).sum(axis=1) + (_MODEL_OF_SHAPE * moments.radius * (solidity - 1))**2)
    sigma = np.hypot(_noise_of_place(moments, blur, noise, slope_noise), model)
    return Blobs(corner + (side - 1) / 2 + moments.centre - shift, moments.area + np.pi * blur**2, sigma, amplitude, solidity, blur)


def _shift(moments, blur, plateau_slope, ground_slope):
    """(N, 2) px shift of the centroids by sloping light; slopes (N, 2) of plateau and ground: of the amplitude per px."""
    radius = moments.radius[:, None]
    lever = plateau_slope * (_EDGE * radius - _EDGE_BLUR * blur) + ground_slope * (_EDGE * radius + _EDGE_BLUR * blur)
    return moments.spread(lever) * (4 * blur / radius**2)


def _ramp(patches, ground, amplitude, most):
    """Weights (N, side^2) float32 of pixels (N, side, side): 0 at LOW, 1 at HIGH between ground and plateau, clipped to most; ground and
    amplitude: (N,) grey levels."""
    scale = 1 / ((HIGH - LOW) * amplitude)
    values = np.multiply(patches.reshape(len(patches), -1), scale[:, None], dtype=np.float32)
    values -= ((ground + LOW * amplitude) * scale)[:, None]
    return np.clip(values, 0, most, out=values)


class _Moments:
    """Area, centroid and central second moments from sums (N, 6) of weights times 1, x, y, xx, xy, yy."""

    def __init__(self, sums: np.ndarray):
        sums = sums.astype(float)
        self.area = np.maximum(sums[:, 0], 1e-6)
        self.centre = sums[:, 1:3] / self.area[:, None]
        x, y = self.centre.T
        self.xx, self.xy, self.yy = (sums[:, 3:] / self.area[:, None]).T - [x * x, x * y, y * y]
        self.xx, self.yy = np.maximum(self.xx, 1e-6), np.maximum(self.yy, 1e-6)
        self.radius = np.sqrt(self.area / np.pi)
        self.solidity = self.area / (4 * np.pi * np.sqrt(np.maximum(self.xx * self.yy - self.xy**2, 1e-6)))

    def spread(self, slope: np.ndarray) -> np.ndarray:
        """(N, 2) second moment matrices times vectors (N, 2)."""
        x, y = slope.T
        return np.stack([self.xx * x + self.xy * y, self.xy * x + self.yy * y], axis=1)

    def ellipse(self, scale: np.ndarray) -> np.ndarray:
        """(N, 6) float32 coefficients of 1, x, y, xx, xy, yy of a quadratic form, negative inside the ellipse scaled by scale (N,)."""
        x, y = self.centre.T
        a, b, c = np.stack([self.yy, -self.xy, self.xx]) / np.maximum(self.xx * self.yy - self.xy**2, 1e-6)
        constant = a * x * x + 2 * b * x * y + c * y * y - 4 * scale**2
        return np.stack([constant, -2 * (a * x + b * y), -2 * (b * x + c * y), a, 2 * b, c], axis=1).astype(np.float32)

    @cached_property
    def perimeter(self) -> np.ndarray:
        """(N,) px, of the ellipse with these moments (Ramanujan's first formula)."""
        a, b = self.axes
        return np.pi * (3 * (a + b) - np.sqrt((3 * a + b) * (a + 3 * b)))

    @cached_property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Semi-major and semi-minor axes (N,) px of that ellipse."""
        half, off = (self.xx + self.yy) / 2, np.hypot((self.xx - self.yy) / 2, self.xy)
        return 2 * np.sqrt(half + off), 2 * np.sqrt(np.maximum(half - off, 0))


def _grown(labels):
    """Labels (H, W) with each region grown by a pixel, except where two would meet."""
    square, one = np.ones((3, 3), np.uint8), labels.dtype.type(1)
    highest = cv2.dilate(labels, square)
    lowest = cv2.erode(labels - one, square)  # the ground's 0 wraps round to the highest value
    return highest * (highest - one == lowest)


def _patches(grey, small, regions, step):
    """Patches (N, side, side) uint8 of the regions in the image and in the small one, 0 in other regions, and their corners (N, 2) px."""
    side = int(regions.box[:, 2:].max()) + 2  # px of the small image
    half = regions.box[:, :2] + regions.box[:, 2:] // 2 - side // 2  # corners
    padded = cv2.copyMakeBorder(grey, step * side, step * side + step, step * side, step * side + step, cv2.BORDER_REPLICATE)
    labels = cv2.copyMakeBorder(_grown(regions.labels), side, side + 1, side, side + 1, cv2.BORDER_CONSTANT, value=0)
    column, row = (half + side).T
    own = _squares(labels, row, column, side) == regions.label.astype(labels.dtype)[:, None, None]
    pixels = _squares(padded, step * row, step * column, step * side)
    around = cv2.copyMakeBorder(small, side, side + 1, side, side + 1, cv2.BORDER_REPLICATE)
    coarse = _squares(around, row, column, side) * own
    if step == 2:  # mask pairs of pixels as 16-bit numbers
        pairs = pixels.view(np.uint16).reshape(len(own), side, 2, side)
        pixels = (pairs & (own * np.uint16(65535))[:, :, None]).view(np.uint8)
    else:
        pixels = pixels * own
    return pixels.reshape(len(own), step * side, step * side), coarse, (step * half).astype(float)


def _squares(image, row, column, side):
    height, width = image.shape
    return as_strided(image, (height - side + 1, width - side + 1, side, side), image.strides * 2)[row, column]


def _levels(small, regions, step):
    """Ground level and amplitude of each region, (N,) float32 grey levels, and the ground's slope (N, 2), of the amplitude per px."""
    outside = _OUTSIDE / step
    at = [_along(*each, outside) for each in zip(regions.centre.T, regions.box[:, 2:].T, _SCALE, small.shape[::-1])]
    levels = small.ravel().take(at[1] * small.shape[1] + at[0])
    around, plateau = levels[:, :len(_RING)].astype(np.float32), levels[:, len(_RING):]
    ground = np.partition(around, _GROUND_RANK, axis=1)[:, _GROUND_RANK]
    amplitude = np.maximum(np.partition(plateau, _PLATEAU_RANK, axis=1)[:, _PLATEAU_RANK] - ground, 1)
    off = (around - ground[:, None]) / amplitude[:, None]
    off[np.abs(off) > _OTHER] = 0
    return ground, amplitude, off @ _RING * (8 / len(_RING)) / (step * (regions.box[:, 2:] + 2 * outside))


def _along(centre, size, scale, length, outside):
    """(N, S) sample positions, whole px, along one axis."""
    at = centre[:, None] + size[:, None] * scale
    at[:, :len(_RING)] += 2 * outside * scale[:len(_RING)]
    return np.minimum(np.maximum(at + 0.5, 0), length - 1).astype(np.int64)


@lru_cache(maxsize=64)
def _basis(side: int, step: int) -> np.ndarray:
    """(side * side, 6) float32: 1, x, y, xx, xy, yy of a patch's pixels, step px wide, from its centre."""
    y, x = (part.ravel() * step for part in np.mgrid[:side, :side] - (side - 1) / 2)
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1).astype(np.float32)


def _blur(weight, moments) -> float:
    """Standard deviation of the edges' blur, px, median over all markers."""
    return upper_median((moments.area - np.einsum('ij,ij->i', weight, weight)) / moments.perimeter) / _WIDTH


def _plateau_slope(values, step, moments, blur, noise):
    """Relative slopes (N, 2) of the plateaus per px, 0 where too little is seen, and their noise (N,).

    values: (N, P) weights in the small image, whose pixels are step px wide.
    """
    basis, away = _basis(int(np.sqrt(values.shape[1])), step), _TO_PLATEAU * blur + _HALF_PIXEL * (step - 1)
    inside = (moments.ellipse(np.maximum(1 - away / np.maximum(moments.axes[1], 1e-6), 0)) @ basis.T < 0).astype(np.float32)
    seen = _Moments(inside @ basis * np.float32(step * step))
    inside *= values
    sums = (inside @ basis[:, :3]).astype(float) * (step * step)
    enough = (seen.area >= _FEWEST)[:, None]
    x, y = (sums[:, 1:] - sums[:, :1] * seen.centre).T
    slope = np.stack([seen.yy * x - seen.xy * y, seen.xx * y - seen.xy * x], axis=1) * (HIGH - LOW)
    slope /= np.maximum(seen.area * (seen.xx * seen.yy - seen.xy**2), 1e-6)[:, None]
    slope = np.where(enough, np.clip(slope, -_STEEPEST, _STEEPEST), 0)
    slope_noise = noise * enough[:, 0] * np.sqrt(4 * np.pi) / np.maximum(seen.area, 1)
    square = (slope**2).sum(axis=1)
    return slope * (square / (square + 2 * slope_noise**2 + 1e-12))[:, None], slope_noise


def _noise(squares) -> float:
    """Standard deviation of plateau pixels, from second differences along the middle row of each patch."""
    side = squares.shape[1]
    row = squares[:, side // 2, max(side // 2 - 3, 0): side // 2 + 4].astype(np.float32)
    bend = row[:, 2:] - 2 * row[:, 1:-1] + row[:, :-2]
    return upper_median(np.abs(bend).ravel()) / (0.6745 * np.sqrt(6))


def _noise_of_place(moments, blur, noise, slope_noise):
    """(N,) px: standard deviation of a position per axis by pixel noise (N,), relative to the amplitude."""
    pixels = 2 * _TURN * blur * moments.perimeter  # on the edge, whose second moment is twice the area's
    by_edge = noise / (HIGH - LOW) * np.sqrt(pixels * (moments.xx + moments.yy)) / moments.area
    return np.hypot(by_edge, _EDGE * blur * moments.radius * slope_noise)
