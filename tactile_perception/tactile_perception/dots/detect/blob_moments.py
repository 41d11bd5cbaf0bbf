# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Large bright markers: where they are (regions of a small image above the mean around them, touching ones told apart), and their
sub-pixel place, size and shape in square patches, all at once."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.lib.stride_tricks import as_strided

from ...common.statistics import upper_median

_LEAST, _MOST = 0.2, 5.0  # of the typical area: what is smaller or larger is no marker
_SPECK = 2  # px of the small image: regions up to this do not count for what is typical
_NECK = 0.72  # of a region's largest distance to its border: where it is narrower, it is cut in two
_SQUARE = np.ones((3, 3), np.uint8)


@dataclass
class Regions:
    """Regions of a small image, none cut by its border: box (N, 4) left, top, width, height; centre (N, 2); area (N,) px of the small
    image; label (N,), and labels (H, W) uint8 or uint16, grown by a pixel: 0 ground."""

    box: np.ndarray
    centre: np.ndarray
    area: np.ndarray
    label: np.ndarray
    labels: np.ndarray

    def __len__(self) -> int:
        return len(self.box)


def find_regions(mask: np.ndarray) -> Regions:
    """Regions of markers' size in a mask, (H, W) uint8."""
    _, labels, stats, centre = cv2.connectedComponentsWithStats(mask, connectivity=8, ltype=cv2.CV_16U)
    labels = labels.astype(np.uint8) if len(stats) < 256 else labels
    stats, centre = stats[1:], centre[1:]
    typical = _typical(stats[:, 4])
    height, width = mask.shape
    left, top, right, bottom = *stats[:, :2].T, *(stats[:, :2] + stats[:, 2:4]).T
    whole = (left > 0) & (top > 0) & (right < width) & (bottom < height)
    kept = np.flatnonzero(whole & (stats[:, 4] > _LEAST * typical) & (stats[:, 4] < _MOST * typical))
    return Regions(stats[kept, :4], centre[kept], stats[kept, 4], kept + 1, _grown(labels))


def _grown(labels):
    """Labels with a pixel more all around each region, but where two would meet."""
    one = labels.dtype.type(1)
    highest = cv2.dilate(labels, _SQUARE)
    lowest = cv2.erode(labels - one, _SQUARE)  # the ground's 0 is the highest then
    return highest * (highest - one == lowest)


def cut_necks(mask: np.ndarray, box: np.ndarray) -> bool:
    """Take pixels out of a mask, in place, that join parts of the region in box (left, top, width, height); whether there were any."""
    left, top, width, height = box
    at = np.s_[top: top + height, left: left + width]
    region = cv2.copyMakeBorder(mask[at], 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    inside = cv2.distanceTransform(region, cv2.DIST_L2, 5)
    count, seeds = cv2.connectedComponents((inside > _NECK * inside.max()).astype(np.uint8))
    if count <= 2:
        return False
    away = np.stack([cv2.distanceTransform((seeds != k).astype(np.uint8), cv2.DIST_L2, 5) for k in range(1, count)])
    nearest = (away.argmin(axis=0) + 1).astype(np.uint8) * (region > 0)
    nearest[nearest == 0] = 255
    low = cv2.erode(nearest, _SQUARE) < nearest
    nearest[nearest == 255] = 0
    cut = low | (cv2.dilate(nearest, _SQUARE) > nearest)  # on both sides, which growing by a pixel makes good
    mask[at][(cut & (nearest > 0))[1:-1, 1:-1]] = 0
    return True


def _typical(area: np.ndarray) -> float:
    some = area[area > _SPECK]
    return upper_median(some) if len(some) else 0.0


LOW, HIGH = 0.2, 0.8  # of the way from ground to plateau: where a pixel begins to count, and counts whole
_TURN = 0.8416  # standard deviations of the blur at which an edge is HIGH
_WIDTH = 0.2673  # sum of w (1 - w) over a straight edge, per standard deviation of its blur
_EDGE = _TURN / (HIGH - LOW)  # px an edge shifts per relative change of its marker's brightness and px of blur
_EDGE_BLUR = 1.247  # what blur takes off that where the light slopes
_CAP = 1.7  # what is brighter in the small image, in ramp units (the plateau is at 1.33), is glare
_MODEL = 0.003  # px: what shapes and light that are not modelled leave of a place
_MODEL_OF_SHIFT = 0.1  # of what is taken off a place for light that slopes, it is as uncertain
_MODEL_OF_SHAPE = 0.7  # of the radius, times what the shape lacks to an ellipse
_FEWEST = 20  # px of plateau: fewer tell no slope
_STEEPEST = 0.05  # slope of the plateau a pixel, of the brightness
_TO_PLATEAU, _HALF_PIXEL = 2.0, 0.65  # blurs from the edge inwards; and px, by which the small image's pixels reach out further
_OTHER = 0.25  # of the amplitude: what differs more from the ground is not ground
_SOFT = 0.9  # what a soft edge takes off the solidity, per square of blur over radius
_RING = np.stack([np.cos(np.arange(12) * np.pi / 6), np.sin(np.arange(12) * np.pi / 6)], axis=1) / 2
_SCALE = np.vstack([_RING, np.array([(a, b) for a in range(-2, 3) for b in range(-2, 3) if abs(a) + abs(b) <= 3]) * 0.11]).T
# where levels are looked at, from a region's centre, of its width and height: on the ground around it, then inside
_OUTSIDE = 3.5  # px from a region's border to where its ground is looked at
_GROUND_RANK, _PLATEAU_RANK = 4, 12  # of the samples in rising order: neighbours on the ground, glare and border on the plateau


@dataclass
class Blobs:
    """N markers: uv (N, 2) px; area (N,) px^2; sigma (N,) px, standard deviation of a place per axis; amplitude (N,) grey levels; solidity
    (N,): area against that of the ellipse with the same second moments, 1 for an ellipse; blur: px, of the edges."""

    uv: np.ndarray
    area: np.ndarray
    sigma: np.ndarray
    amplitude: np.ndarray
    solidity: np.ndarray
    blur: float


def fit_blobs(grey: np.ndarray, small: np.ndarray, step: int, regions: Regions) -> Blobs:
    """Markers (bright) of an image (H, W) uint8 in regions of the small image, step times smaller (1 or 2)."""
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
    """(N, 2) px by which light moves the edges, whose plateau and ground have these slopes (shares of the amplitude a pixel)."""
    radius = moments.radius[:, None]
    lever = plateau_slope * (_EDGE * radius - _EDGE_BLUR * blur) + ground_slope * (_EDGE * radius + _EDGE_BLUR * blur)
    return moments.spread(lever) * (4 * blur / radius**2)


def _ramp(patches, ground, amplitude, most):
    """How far pixels (N, side, side) are from LOW (0) to HIGH (1), up to most, of the way from ground to plateau, (N,) grey levels each, as
    (N, side^2) float32."""
    scale = 1 / ((HIGH - LOW) * amplitude)
    values = np.multiply(patches.reshape(len(patches), -1), scale[:, None], dtype=np.float32)
    values -= ((ground + LOW * amplitude) * scale)[:, None]
    return np.clip(values, 0, most, out=values)


class _Moments:
    """Moments up to the second of weights, from the sums (N, 6) over 1, x, y, xx, xy, yy."""

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
        """(N, 2) products of the second moments and vectors (N, 2)."""
        x, y = slope.T
        return np.stack([self.xx * x + self.xy * y, self.xy * x + self.yy * y], axis=1)

    def ellipse(self, scale: np.ndarray) -> np.ndarray:
        """(N, 6) float32 coefficients of 1, x, y, xx, xy, yy of a form that is negative inside the ellipse, shrunk by scale (N,)."""
        x, y = self.centre.T
        a, b, c = np.stack([self.yy, -self.xy, self.xx]) / np.maximum(self.xx * self.yy - self.xy**2, 1e-6)
        constant = a * x * x + 2 * b * x * y + c * y * y - 4 * scale**2
        return np.stack([constant, -2 * (a * x + b * y), -2 * (b * x + c * y), a, 2 * b, c], axis=1).astype(np.float32)

    @cached_property
    def perimeter(self) -> np.ndarray:
        """(N,) px of the ellipse with these moments, by Ramanujan's first formula."""
        a, b = self.axes
        return np.pi * (3 * (a + b) - np.sqrt((3 * a + b) * (a + 3 * b)))

    @cached_property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """(N,) px: half of the larger and of the smaller axis of that ellipse."""
        half, off = (self.xx + self.yy) / 2, np.hypot((self.xx - self.yy) / 2, self.xy)
        return 2 * np.sqrt(half + off), 2 * np.sqrt(np.maximum(half - off, 0))


def _patches(grey, small, regions, step):
    """Squares (N, side, side) uint8 about the regions, of the image and of the small one, 0 where it is another's, and the places (N, 2) px
    of their first pixels."""
    side = int(regions.box[:, 2:].max()) + 2  # px of the small image
    half = regions.box[:, :2] + regions.box[:, 2:] // 2 - side // 2  # corners
    padded = cv2.copyMakeBorder(grey, step * side, step * side + step, step * side, step * side + step, cv2.BORDER_REPLICATE)
    labels = cv2.copyMakeBorder(regions.labels, side, side + 1, side, side + 1, cv2.BORDER_CONSTANT, value=0)
    column, row = (half + side).T
    own = _squares(labels, row, column, side) == regions.label.astype(labels.dtype)[:, None, None]
    pixels = _squares(padded, step * row, step * column, step * side)
    around = cv2.copyMakeBorder(small, side, side + 1, side, side + 1, cv2.BORDER_REPLICATE)
    coarse = _squares(around, row, column, side) * own
    if step == 2:  # a pair of pixels is one number of 16 bits
        pairs = pixels.view(np.uint16).reshape(len(own), side, 2, side)
        pixels = (pairs & (own * np.uint16(65535))[:, :, None]).view(np.uint8)
    else:
        pixels = pixels * own
    return pixels.reshape(len(own), step * side, step * side), coarse, (step * half).astype(float)


def _squares(image, row, column, side):
    height, width = image.shape
    return as_strided(image, (height - side + 1, width - side + 1, side, side), image.strides * 2)[row, column]


def _levels(small, regions, step):
    """Grey levels of the ground around each region, and of its plateau above that, (N,) float32 each, and the ground's slope (N, 2), as
    shares of the latter a pixel."""
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
    """(N, S) pixels at which levels are looked at, along one axis."""
    at = centre[:, None] + size[:, None] * scale
    at[:, :len(_RING)] += 2 * outside * scale[:len(_RING)]
    return np.minimum(np.maximum(at + 0.5, 0), length - 1).astype(np.int64)


@lru_cache(maxsize=64)
def _basis(side: int, step: int) -> np.ndarray:
    """(side * side, 6) float32: 1, x, y, xx, xy, yy of the pixels, step px wide, of a square from its middle."""
    y, x = (part.ravel() * step for part in np.mgrid[:side, :side] - (side - 1) / 2)
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1).astype(np.float32)


def _blur(weight, moments) -> float:
    """Standard deviation of the edges' blur, px, median of some thirty markers."""
    some = slice(None, None, 1 + len(weight) // 32)
    partly = moments.area[some] - np.einsum('ij,ij->i', weight[some], weight[some])
    return upper_median(partly / moments.perimeter[some]) / _WIDTH


def _plateau_slope(values, step, moments, blur, noise):
    """(N, 2) slopes of the plateau, as shares of the brightness a pixel, where enough of it is seen; else 0; and their noise (N,).

    values: (N, P) of the small image's pixels, step px wide: what is nearly straight shows there as well.
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
    """Standard deviation of a pixel of a plateau, from second differences along the middle row of each square."""
    side = squares.shape[1]
    row = squares[:, side // 2, max(side // 2 - 3, 0): side // 2 + 4].astype(np.float32)
    bend = row[:, 2:] - 2 * row[:, 1:-1] + row[:, :-2]
    return upper_median(np.abs(bend).ravel()) / (0.6745 * np.sqrt(6))


def _noise_of_place(moments, blur, noise, slope_noise):
    """(N,) px: what noise (of a pixel, as a share of the amplitude) makes of a place along an axis."""
    pixels = 2 * _TURN * blur * moments.perimeter  # on the edge, whose second moment is twice the area's
    by_edge = noise / (HIGH - LOW) * np.sqrt(pixels * (moments.xx + moments.yy)) / moments.area
    return np.hypot(by_edge, _EDGE * blur * moments.radius * slope_noise)
