# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Colour of the bright background around each dot, as logarithms of channel ratios."""
from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from ..._core import ring_colours
from ...common.statistics import robust_sigma
from ...errors import BadFrame

POINTS = 16  # on a ring around each dot, each the sum of 3 x 3 pixels (src/touchpad/optics/ring_colour.cpp)
RING_PIXELS = 9 * POINTS
CLIPPED = 250  # mean grey level of red from which some of its pixels may be clipped; chosen: a few levels of noise below
GROUND = 0.93  # share of the brightest surrounding pixel from which a pixel is background, at rest, where shading varies slowly; chosen
RING = 0.45  # radius over the pitch; chosen: the farthest from the dot without the rim of the next one
WIDE = 0.55  # the same where dots bleed into the background: colour at reduced resolution (4:2:0, 4:2:2, JPEG); chosen
BLED = 2e-3  # difference of log blue/red between the two rings from which colour bleeds; chosen: four times that of a dented surface
NOISE_FLOOR = 0.5  # grey levels, mean below which a channel has no information; chosen


def check_image(image: np.ndarray) -> np.ndarray:
    """The image itself if it is (H, W, 3) uint8. Raises BadFrame."""
    if not isinstance(image, np.ndarray) or image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
        shape = getattr(image, 'shape', None)
        raise BadFrame(f'surface: need a colour image (H, W, 3) uint8 in BGR order, got {shape}; set the camera to bgr8')
    return image


def pitch_px(uv: np.ndarray) -> float:
    """Median distance, px, from each of the dots at uv (N, 2) to the nearest other one. Raises BadFrame for less than 9 dots."""
    if len(uv) < 9:
        raise BadFrame(f'surface: need at least 9 dots for their pitch, got {len(uv)}')
    points = uv - uv.mean(0)
    length = np.square(points).sum(1)
    square = length[:, None] + length - 2 * points @ points.T
    np.fill_diagonal(square, np.inf)
    return float(np.sqrt(np.median(square.min(1))))


def ring_share(image: np.ndarray, uv: np.ndarray) -> float:
    """Radius over the pitch of the sampling ring around dots at uv (N, 2) px: WIDE if colour bleeds, else RING.

    image: (H, W, 3) uint8 BGR, untouched. Colour bleeding changes the background's colour near the dots.
    """
    pitch = pitch_px(uv)
    near, far = (log_ratios(image, uv, share * pitch).ratios[:, 0] for share in (RING, WIDE))
    gap = (near - far)[np.isfinite(near - far)]
    if len(gap) == 0:
        return RING
    middle = np.median(gap)
    sigma = robust_sigma(gap - middle) / np.sqrt(len(gap))
    return WIDE if abs(middle) > BLED + 4 * sigma else RING


@dataclass
class RingColours:
    """ratios: (N, 2) logarithms of blue/red and green/red; brightness: (N,) logarithm of red, grey levels; count: (N,) ring points used;
    patchiness: (N,) relative variance of blue/red around the ring without its linear gradient: noise, glare, sharp edges."""

    ratios: np.ndarray
    brightness: np.ndarray
    count: np.ndarray
    patchiness: np.ndarray


def log_ratios(image: np.ndarray, uv: np.ndarray, radius: float) -> RingColours:
    """Colour of the background around dots.

    image: (H, W, 3) uint8 BGR; uv: (N, 2) px; radius: of the ring, px. Points on ink, on glare or outside the image are not used; ratios
    are NaN with less than a quarter of the points or a dark channel. Raises BadFrame for a wrong image.
    Kernel: src/touchpad/optics/ring_colour.cpp.
    """
    return RingColours(*ring_colours(check_image(image), np.asarray(uv, float), float(radius)))


class Background(NamedTuple):
    """Places between dots. uv: (M, 2) px; ratios: (M, 2) logarithms of blue/red and green/red; brightness: (M,) logarithm of red, grey
    levels; pixels: (M,) number used."""

    uv: np.ndarray
    ratios: np.ndarray
    brightness: np.ndarray
    pixels: np.ndarray


def background_ratios(image: np.ndarray, radius: float, step: int = 12) -> Background:
    """Colour of the background between the dots of an untouched image.

    image: (H, W, 3), uint8 or float mean of several frames; radius: of the sampling ring, px; cells: step x step pixels. A pixel is
    background if it is nearly as bright as the brightest around it.
    """
    values = np.ascontiguousarray(image, np.float32)
    blue, green, red = cv2.split(values)
    smooth = cv2.blur(blue + green + red, (3, 3))
    size = 2 * int(np.ceil(radius)) + 1
    ground = smooth > GROUND * cv2.dilate(cv2.blur(smooth, (5, 5)), np.ones((size, size), np.uint8))
    ground &= (smooth > 0.2 * np.percentile(smooth[::4, ::4], 90)) & (cv2.blur(red, (3, 3)) < CLIPPED)
    ground = cv2.erode(ground.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(np.float32)
    return _cells(values, ground, step)


def _cells(values: np.ndarray, ground: np.ndarray, step: int) -> Background:
    """Means over the background pixels of cells of step x step pixels."""
    rows, columns = (side // step for side in ground.shape)
    mask = ground[:rows * step, :columns * step]
    v, u = np.mgrid[0:rows * step, 0:columns * step].astype(np.float32)
    means = [cv2.resize(part * mask, (columns, rows), interpolation=cv2.INTER_AREA).ravel()
             for part in (*cv2.split(values[:rows * step, :columns * step]), u, v, np.float32(1))]
    sums = np.stack(means, axis=1).astype(float) * step**2
    sums = sums[(sums[:, 5] > step * step // 4 - 0.5) & (sums[:, :3].min(1) > NOISE_FLOOR * sums[:, 5])]
    logs = np.log(sums[:, :3])
    return Background(sums[:, 3:5] / sums[:, 5:], logs[:, :2] - logs[:, 2:], logs[:, 2] - np.log(sums[:, 5]), sums[:, 5])
