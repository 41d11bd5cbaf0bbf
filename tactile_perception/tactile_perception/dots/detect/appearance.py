# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Appearance of dots measured in one image: colour channel, size, contrast, blur and noise."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from .dot_profile import blurred_disc
from ...errors import BadFrame

CHANNELS = ('blue', 'green', 'red', 'grey')
_BLOCKS = (15, 31, 61, 121)  # px, candidate sides of the box of the local mean. Chosen: in octaves, for dots of 4 to 60 px
_LEVELS = (0.25, 0.5)  # candidate thresholds, parts of the strongest contrast. Chosen
_LARGEST_FITTED = 14.0  # px: larger dots are measured in a reduced image, which bounds the time. Chosen
_MOST = 60  # dots used for the blur: bounds the time. Chosen
_PER_PIXEL = 24  # samples of a profile per pixel. Chosen
_FEWEST = 4  # dots; fewer cannot be distinguished from dirt. Chosen
_ENOUGH = 30  # dots in the middle of the image from which it decides on the channel, in a quarter of the time. Chosen


@dataclass(frozen=True)
class Look:
    """Appearance of dots in a frame.

    channel: a name in CHANNELS; step: factor by which the image is reduced; smallest, typical, largest: diameters, px of the reduced
    image; blur: standard deviation, px of the reduced image; contrast (dot minus background), ground (background), noise: grey levels.
    """

    channel: str
    step: int
    smallest: float
    typical: float
    largest: float
    blur: float
    contrast: float
    ground: float
    noise: float


@dataclass
class _Blobs:
    """Round regions of similar size: centre (N, 2) px, diameter (N,) px, contrast: grey levels, score: likeness to printed dots."""

    centre: np.ndarray
    diameter: np.ndarray
    contrast: float
    score: float


def select_channel(image: np.ndarray, channel: str) -> np.ndarray:
    """(H, W) uint8: one channel of a BGR image, or its grey mean; grey images are returned unchanged."""
    if image.ndim == 2:
        return image
    if channel == 'grey':
        return cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return cv2.extractChannel(image, CHANNELS.index(channel))


def shrink(grey: np.ndarray, step: int) -> np.ndarray:
    """The image with each block of step x step pixels averaged into one."""
    return grey if step == 1 else cv2.resize(grey, (grey.shape[1] // step, grey.shape[0] // step), interpolation=cv2.INTER_AREA)


def measure_look(image: np.ndarray, sign: int) -> Look:
    """Measure the channel with the most salient dots, their sizes, contrast and blur.

    image: (H, W) or (H, W, 3) uint8; sign: 1 for bright dots, -1 for dark ones. Raises BadFrame with fewer than four similar dots.
    """
    planes = {channel: select_channel(image, channel) for channel in (CHANNELS if image.ndim == 3 else CHANNELS[-1:])}
    noises = {channel: _noise(grey) for channel, grey in planes.items()}
    channel = CHANNELS[-1] if image.ndim == 2 else _clearest(planes, noises, sign)
    blobs = _find_blobs(planes[channel], sign, noises[channel], _LEVELS)
    if blobs is None:
        raise BadFrame(f'no {"bright" if sign > 0 else "dark"} dots found in the frame: check light, focus and the parameter polarity')
    return _describe(channel, planes[channel], noises[channel], blobs, sign)


def _clearest(planes, noises, sign):
    """The channel, of planes by name, with the most salient dots: in the middle of the image, in the whole if it has few."""
    rows, columns = (side // 4 for side in planes['grey'].shape)
    for part, levels in (np.s_[rows:-rows, columns:-columns], _LEVELS[1:]), (np.s_[:, :], _LEVELS):
        blobs = {name: _find_blobs(grey[part], sign, noises[name], levels) for name, grey in planes.items()}
        best = max(planes, key=lambda name: blobs[name].score / noises[name] if blobs[name] else 0.0)
        if blobs[best] and len(blobs[best].diameter) >= _ENOUGH:
            break
    return best


def _noise(grey):
    """Standard deviation of pixel noise, grey levels, from the median absolute second difference; at least that of rounding."""
    g = grey.astype(np.int16)
    second = g[1:-1:2, 1:-1:2] * 4 - 2 * (g[:-2:2, 1:-1:2] + g[2::2, 1:-1:2] + g[1:-1:2, :-2:2] + g[1:-1:2, 2::2])
    second += g[:-2:2, :-2:2] + g[:-2:2, 2::2] + g[2::2, :-2:2] + g[2::2, 2::2]
    return max(float(np.median(np.abs(second))) / (0.6745 * 6), 0.3)


def _find_blobs(grey, sign, noise, levels):
    smooth = cv2.GaussianBlur(grey, (3, 3), 0).astype(np.float32) * sign
    best = None
    for block in _BLOCKS:
        above = smooth - cv2.blur(smooth, (block, block))
        strongest = np.percentile(above[::2, ::2], 99.5)
        for level in levels:
            if level * strongest < 3 * noise:
                continue
            blobs = _roundish(above, level * strongest)
            if blobs is not None and (best is None or blobs.score > best.score):
                best = blobs
    return best


def _roundish(above, threshold):
    """Regions above the threshold that are round, inside the image and of similar size, or None."""
    _, _, stats, centre = cv2.connectedComponentsWithStats((above > threshold).astype(np.uint8), connectivity=4)
    left, top, wide, high, area = stats[1:].T
    inside = (left > 0) & (top > 0) & (left + wide < above.shape[1]) & (top + high < above.shape[0])
    fill = area / (wide * high)
    good = inside & (area >= 6) & (np.maximum(wide, high) <= 1.6 * np.minimum(wide, high) + 1) & (fill > 0.55)
    if good.sum() < _FEWEST:
        return None
    area, centre = area[good].astype(float), centre[1:][good]
    typical = np.median(np.repeat(area, np.maximum(area / area.min(), 1).astype(int)))
    like = (area > typical / 3.5) & (area < typical * 3)
    if like.sum() < _FEWEST:
        return None
    area, centre = area[like], centre[like]
    at = np.rint(centre).astype(int)
    contrast = float(np.median(above[at[:, 1], at[:, 0]]))
    return _Blobs(centre, np.sqrt(4 / np.pi * area), contrast, len(area) * contrast * np.sqrt(np.median(area)))


def _describe(channel, grey, noise, blobs, sign):
    step = int(np.ceil(np.median(blobs.diameter) / _LARGEST_FITTED))
    grey = shrink(grey, step)
    centre, rough = (blobs.centre + 0.5) / step - 0.5, blobs.diameter / step
    blur, diameter, contrast = _fit_blur(grey, centre, rough, noise / step)
    low, middle, high = np.percentile(diameter, [2, 50, 98])
    return Look(channel, step, max(0.8 * float(low), 1.5), float(middle), 1.15 * float(high), blur, sign * contrast, _ground_level(grey,
        centre, 0.5 * middle + 2 + 2 * blur), noise / step)


def _ground_level(grey, centre, away):
    """Median grey level at a distance away, px, diagonally from the dots, where a grid has no dots."""
    away *= np.sqrt(0.5)
    row = np.clip(np.rint(centre[:, 1] + away).astype(int), 0, grey.shape[0] - 1)
    column = np.clip(np.rint(centre[:, 0] + away).astype(int), 0, grey.shape[1] - 1)
    return float(np.median(grey[row, column]))


def _fit_blur(grey, centre, rough, noise):
    """Common blur, diameters and median contrast by grid search: coarse around the regions' centroids, then fine around grey-weighted
    centroids."""
    half = int(np.ceil(np.percentile(rough, 90) / 2 + 3))
    at = np.rint(centre).astype(int)
    inside = ((at >= half) & (at < np.array(grey.shape[::-1]) - half)).all(1)
    chosen = np.flatnonzero(inside)[:: max(1, int(inside.sum() / _MOST))]
    if len(chosen) < _FEWEST:
        raise BadFrame('the dots are too near to the border of the frame: check the camera\'s aim')
    reach = np.arange(-half, half + 1)
    patches = grey[at[chosen, 1, None, None] + reach[:, None], at[chosen, 0, None, None] + reach].astype(float)
    x, y = np.meshgrid(reach, reach)
    offset = centre[chosen] - at[chosen]
    discs = _Discs(np.median(rough[chosen]), 1.5 * half + 2)
    coarse = _scan(patches, _distances(x, y, offset), rough[chosen], discs, range(0, len(discs.blurs), 2), slice(None, None, 2))
    offset = _recentre(patches, offset, x, y, coarse[1])
    near = int(np.argmin(np.abs(discs.blurs - coarse[0])))
    around = range(max(near - 2, 0), min(near + 3, len(discs.blurs)))
    first, last = np.searchsorted(discs.diameters, [coarse[1].min(), coarse[1].max()])
    sizes = slice(max(first - 2, 0), last + 3)
    blur, diameter, contrast = _scan(patches, _distances(x, y, offset), rough[chosen], discs, around, sizes)
    scale = np.median(diameter / rough[chosen])
    return blur, rough * scale, float(np.median(np.abs(contrast)))


def _distances(x, y, offset):
    """(N, H, W) px, distances of pixels at x, y (H, W) from positions (N, 2)."""
    return np.hypot(x - offset[:, 0, None, None], y - offset[:, 1, None, None])


class _Discs:
    """Profiles of blurred discs over a grid of blurs and diameters; about: px, central diameter; outermost: px, radius."""

    def __init__(self, about: float, outermost: float):
        self.blurs = np.array([0.2, 0.35, 0.5, 0.7, 0.9, 1.1, 1.35, 1.6, 2.0, 2.5, 3.2])
        self.diameters = np.linspace(0.6, 1.5, 28) * about
        self._last = int(outermost * _PER_PIXEL)
        self._radius = np.arange(self._last + 1) / _PER_PIXEL
        self._profiles: dict[tuple[int, int], np.ndarray] = {}

    def images(self, blur: int, chosen: range, radius: np.ndarray):
        """For each chosen diameter, the brightness at distances radius (any shape, px) from the centre; blur: index of the blur."""
        index = np.minimum(np.rint(radius * _PER_PIXEL), self._last).astype(np.int32)
        return (self._profile(blur, k).take(index) for k in chosen)

    def _profile(self, blur: int, diameter: int) -> np.ndarray:
        if (blur, diameter) not in self._profiles:
            self._profiles[blur, diameter] = np.float32(blurred_disc(self._radius, self.diameters[diameter], self.blurs[blur]))
        return self._profiles[blur, diameter]


def _scan(patches, radius, rough, discs, blurs, part):
    """(blur, diameters (N,), contrasts (N,)) with the least residual; contrast and ground are free for each dot. blurs: indices; part:
    slice of the diameters."""
    diameters = np.arange(len(discs.diameters))[part]
    totals, found, each = [], [], np.arange(len(rough))
    window = (radius < (rough / 2 + 2.5)[:, None, None]).reshape(len(rough), -1)
    wanted = _Windowed(patches.reshape(len(rough), -1), window)
    radius = radius.reshape(len(rough), -1)
    for blur in blurs:
        fits = [wanted.residual(image) for image in discs.images(blur, diameters, radius)]
        residual, contrast = np.array([f[0] for f in fits]), np.array([f[1] for f in fits])
        k = np.argmin(residual, 0)
        totals.append(np.median(residual[k, each]))
        found.append((discs.diameters[diameters[k]], contrast[k, each]))
    k = int(np.argmin(totals))
    return _vertex(discs.blurs[list(blurs)], totals, k), *found[k]


class _Windowed:
    """Least squares of patches (N, P) within windows (N, P) bool."""

    def __init__(self, patches, window):
        self._window, self._count = window.astype(np.float32), window.sum(1)
        self._mean = (patches * window).sum(1) / self._count
        self._rest = ((patches - self._mean[:, None]) * window).astype(np.float32)
        self._square = np.einsum('ij,ij->i', self._rest, self._rest, dtype=float)

    def residual(self, image):
        """Mean squared residuals (N,) of a fit of image (N, P) with free contrast and ground, and the contrasts (N,)."""
        mean = np.einsum('ij,ij->i', image, self._window) / self._count
        square = np.maximum(np.einsum('ij,ij,ij->i', image, image, self._window) - self._count * mean**2, 1e-9)
        product = np.einsum('ij,ij->i', image, self._rest)
        return (self._square - product**2 / square) / self._count, product / square


def _vertex(grid, values, k):
    """Position of the minimum by a parabola through the least value and its neighbours."""
    if k == 0 or k == len(grid) - 1:
        return float(grid[k])
    a, b, _ = np.polyfit(grid[k - 1:k + 2], values[k - 1:k + 2], 2)
    return float(np.clip(-b / (2 * a), grid[k - 1], grid[k + 1]))


def _recentre(patches, offset, x, y, diameter):
    """Grey-weighted centroids over discs a little larger than the dots."""
    near = np.hypot(x - offset[:, 0, None, None], y - offset[:, 1, None, None])
    ring = (near > diameter.max() / 2 + 1.0) & (near < diameter.max() / 2 + 2.5)
    ground = (patches * ring).sum((1, 2)) / ring.sum((1, 2))
    weight = (patches - ground[:, None, None]) * np.clip(diameter[:, None, None] / 2 + 1.5 - near, 0, 1)
    total = weight.sum((1, 2))
    return np.stack([(weight * x).sum((1, 2)) / total, (weight * y).sum((1, 2)) / total], 1)
