# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What dots look like in an image, measured from that image alone: colour channel, size, contrast, blur and noise."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from .dot_profile import blurred_disc
from ...errors import BadFrame

CHANNELS = ('blue', 'green', 'red', 'grey')
_BLOCKS = (15, 31, 61, 121)  # sides of the squares that local ground is taken over, px
_LEVELS = (0.25, 0.5)  # of the strongest contrast
_LARGEST_FITTED = 14.0  # px: larger dots are looked at in a smaller image
_MOST = 60  # dots that blur is measured on
_PER_PIXEL = 24  # samples of a profile a pixel
_FEWEST = 4  # dots; fewer cannot be told from dirt


@dataclass(frozen=True)
class Look:
    """Measured from a frame. channel: a name in CHANNELS; step: every so many pixels are averaged into one before all else;
    smallest, typical, largest: diameters, blur: standard deviation, all in pixels so averaged; contrast: dot minus ground, ground and
    noise: grey levels.
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
    """Roundish spots of like size: centre (N, 2), diameter (N,), score: how much they look like printed dots."""

    centre: np.ndarray
    diameter: np.ndarray
    contrast: float
    score: float


def select_channel(image: np.ndarray, channel: str) -> np.ndarray:
    """(H, W) uint8: one channel of a BGR image, or its grey mean; a grey image passes as it is."""
    if image.ndim == 2:
        return image
    if channel == 'grey':
        return cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return cv2.extractChannel(image, CHANNELS.index(channel))


def shrink(grey: np.ndarray, step: int) -> np.ndarray:
    """The image with each step x step pixels averaged into one."""
    return grey if step == 1 else cv2.resize(grey, (grey.shape[1] // step, grey.shape[0] // step), interpolation=cv2.INTER_AREA)


def measure_look(image: np.ndarray, sign: int) -> Look:
    """Find the channel in which dots stand out most, their sizes, contrast and blur.

    image: (H, W) or (H, W, 3) uint8; sign: 1 for dots brighter than their ground, -1 for darker. Raises BadFrame where no four like dots
    stand out.
    """
    best = None
    for channel in CHANNELS if image.ndim == 3 else CHANNELS[-1:]:
        grey = select_channel(image, channel)
        noise = _noise(grey)
        blobs = _find_blobs(grey, sign, noise)
        if blobs is not None and (best is None or blobs.score / noise > best[0]):
            best = blobs.score / noise, channel, grey, noise, blobs
    if best is None:
        raise BadFrame(f'no {"bright" if sign > 0 else "dark"} dots stand out in the frame: check light, focus and the parameter polarity')
    return _describe(*best[1:], sign)


def _noise(grey):
    """Standard deviation of pixel noise, by the median size of second differences; at least that of rounding."""
    g = grey.astype(np.int16)
    second = g[1:-1:2, 1:-1:2] * 4 - 2 * (g[:-2:2, 1:-1:2] + g[2::2, 1:-1:2] + g[1:-1:2, :-2:2] + g[1:-1:2, 2::2])
    second += g[:-2:2, :-2:2] + g[:-2:2, 2::2] + g[2::2, :-2:2] + g[2::2, 2::2]
    return max(float(np.median(np.abs(second))) / (0.6745 * 6), 0.3)


def _find_blobs(grey, sign, noise):
    smooth = cv2.GaussianBlur(grey, (3, 3), 0).astype(np.float32) * sign
    best = None
    for block in _BLOCKS:
        above = smooth - cv2.blur(smooth, (block, block))
        strongest = np.percentile(above[::2, ::2], 99.5)
        for level in _LEVELS:
            if level * strongest < 3 * noise:
                continue
            blobs = _roundish(above, level * strongest)
            if blobs is not None and (best is None or blobs.score > best.score):
                best = blobs
    return best


def _roundish(above, threshold):
    """Connected spots above the threshold that are round, whole and of like size, or None."""
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
    """Median grey level this far (px) from the dots, slantwise, where a lattice has no dots."""
    away *= np.sqrt(0.5)
    row = np.clip(np.rint(centre[:, 1] + away).astype(int), 0, grey.shape[0] - 1)
    column = np.clip(np.rint(centre[:, 0] + away).astype(int), 0, grey.shape[1] - 1)
    return float(np.median(grey[row, column]))


def _fit_blur(grey, centre, rough, noise):
    """Blur that all dots share, their diameters and median contrast: the least residual over a grid, discs about the grey-weighted
    centres; first over a coarse one about rough centres."""
    half = int(np.ceil(np.percentile(rough, 90) / 2 + 3))
    at = np.rint(centre).astype(int)
    inside = ((at >= half) & (at < np.array(grey.shape[::-1]) - half)).all(1)
    chosen = np.flatnonzero(inside)[:: max(1, int(inside.sum() / _MOST))]
    if len(chosen) < _FEWEST:
        raise BadFrame('the dots lie too near to the border of the frame to measure them: check the camera\'s aim')
    reach = np.arange(-half, half + 1)
    patches = grey[at[chosen, 1, None, None] + reach[:, None], at[chosen, 0, None, None] + reach].astype(float)
    x, y = np.meshgrid(reach, reach)
    offset = centre[chosen] - at[chosen]
    discs = _Discs(np.median(rough[chosen]), 1.5 * half + 2)
    coarse = _scan(patches, _distances(x, y, offset), rough[chosen], discs, range(0, len(discs.blurs), 2), slice(None, None, 2))
    offset = _recentre(patches, offset, x, y, coarse[1])
    near = int(np.argmin(np.abs(discs.blurs - coarse[0])))
    around = range(max(near - 2, 0), min(near + 3, len(discs.blurs)))
    blur, diameter, contrast = _scan(patches, _distances(x, y, offset), rough[chosen], discs, around, slice(None))
    scale = np.median(diameter / rough[chosen])
    return blur, rough * scale, float(np.median(np.abs(contrast)))


def _distances(x, y, offset):
    """(N, H, W) px of the pixels at x, y (H, W) from places (N, 2)."""
    return np.hypot(x - offset[:, 0, None, None], y - offset[:, 1, None, None])


class _Discs:
    """Images of discs about a diameter (px), by their profiles out to a radius (px), over a grid of blurs and diameters."""

    def __init__(self, about: float, outermost: float):
        self.blurs = np.array([0.2, 0.35, 0.5, 0.7, 0.9, 1.1, 1.35, 1.6, 2.0, 2.5, 3.2])
        self.diameters = np.linspace(0.6, 1.5, 28) * about
        self._last = int(outermost * _PER_PIXEL)
        self._radius = np.arange(self._last + 1) / _PER_PIXEL
        self._profiles: dict[tuple[int, int], np.ndarray] = {}

    def images(self, blur: int, chosen: range, radius: np.ndarray):
        """For each of the chosen diameters the brightness at these distances (any shape, px) from the centre, at blur number `blur`."""
        index = np.minimum(np.rint(radius * _PER_PIXEL), self._last).astype(np.int32)
        return (self._profile(blur, k).take(index) for k in chosen)

    def _profile(self, blur: int, diameter: int) -> np.ndarray:
        if (blur, diameter) not in self._profiles:
            self._profiles[blur, diameter] = np.float32(blurred_disc(self._radius, self.diameters[diameter], self.blurs[blur]))
        return self._profiles[blur, diameter]


def _scan(patches, radius, rough, discs, blurs, part):
    """(blur, diameters (N,), contrasts (N,)) of least residual over a grid, contrast and ground free for each dot; blurs: their numbers;
    part: of the diameters, a slice."""
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
    """Patches (N, P) within windows (N, P) bool."""

    def __init__(self, patches, window):
        self._window, self._count = window.astype(np.float32), window.sum(1)
        self._mean = (patches * window).sum(1) / self._count
        self._rest = ((patches - self._mean[:, None]) * window).astype(np.float32)
        self._square = np.einsum('ij,ij->i', self._rest, self._rest, dtype=float)

    def residual(self, image):
        """(N,) mean squares that are left by images (N, P) of free contrast on free ground, and (N,) the contrasts."""
        mean = np.einsum('ij,ij->i', image, self._window) / self._count
        square = np.maximum(np.einsum('ij,ij,ij->i', image, image, self._window) - self._count * mean**2, 1e-9)
        product = np.einsum('ij,ij->i', image, self._rest)
        return (self._square - product**2 / square) / self._count, product / square


def _vertex(grid, values, k):
    """Place of the least value by a parabola through the least and its neighbours."""
    if k == 0 or k == len(grid) - 1:
        return float(grid[k])
    a, b, _ = np.polyfit(grid[k - 1:k + 2], values[k - 1:k + 2], 2)
    return float(np.clip(-b / (2 * a), grid[k - 1], grid[k + 1]))


def _recentre(patches, offset, x, y, diameter):
    """Grey-weighted centres over discs a little larger than the dots."""
    near = np.hypot(x - offset[:, 0, None, None], y - offset[:, 1, None, None])
    ring = (near > diameter.max() / 2 + 1.0) & (near < diameter.max() / 2 + 2.5)
    ground = (patches * ring).sum((1, 2)) / ring.sum((1, 2))
    weight = (patches - ground[:, None, None]) * np.clip(diameter[:, None, None] / 2 + 1.5 - near, 0, 1)
    total = weight.sum((1, 2))
    return np.stack([(weight * x).sum((1, 2)) / total, (weight * y).sum((1, 2)) / total], 1)
