# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Regions of large bright markers in a reduced image, and their subpixel position, size and shape
(kernel fit_blobs: src/dots/detect/blob_fit.cpp)."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ..._core import fit_blobs as fit_regions
from ...common.statistics import upper_median

_LEAST, _MOST = 0.2, 5.0  # median areas, smallest and largest marker. Chosen
_SPECK = 2  # px of the small image, largest region that the median area ignores. Chosen
_NECK = 0.72  # of a region's largest distance to its border: narrower parts are necks between overlapping markers. Chosen
_SQUARE = np.ones((3, 3), np.uint8)


@dataclass
class Regions:
    """Regions inside a small image, px of it. box: (N, 4) left, top, width, height; centre: (N, 2); area: (N,); label: (N,); labels: (H, W)
    uint16, 0 ground."""

    box: np.ndarray
    centre: np.ndarray
    area: np.ndarray
    label: np.ndarray
    labels: np.ndarray

    def __len__(self) -> int:
        return len(self.box)


def find_regions(mask: np.ndarray) -> Regions:
    """Regions of a marker's size in a mask (H, W) uint8."""
    _, labels, stats, centre = cv2.connectedComponentsWithStats(mask, connectivity=8, ltype=cv2.CV_16U)
    stats, centre = stats[1:], centre[1:]
    typical = _typical(stats[:, 4])
    height, width = mask.shape
    left, top, right, bottom = *stats[:, :2].T, *(stats[:, :2] + stats[:, 2:4]).T
    whole = (left > 0) & (top > 0) & (right < width) & (bottom < height)
    kept = np.flatnonzero(whole & (stats[:, 4] > _LEAST * typical) & (stats[:, 4] < _MOST * typical))
    return Regions(stats[kept, :4], centre[kept], stats[kept, 4], (kept + 1).astype(np.uint16), labels)


def cut_necks(mask: np.ndarray, box: np.ndarray) -> bool:
    """Clear the necks of the region in box (left, top, width, height) of a mask, in place; returns whether there were any."""
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
    cut = low | (cv2.dilate(nearest, _SQUARE) > nearest)  # on both sides; the dilation by a pixel restores it
    mask[at][(cut & (nearest > 0))[1:-1, 1:-1]] = 0
    return True


def _typical(area: np.ndarray) -> float:
    some = area[area > _SPECK]
    return upper_median(some) if len(some) else 0.0


@dataclass
class Blobs:
    """Markers. uv: (N, 2) px; area: (N,) px^2; sigma: (N,) px, standard deviation of a position per axis; amplitude: (N,) grey levels;
    solidity: (N,) area over that of the ellipse with the same second moments; blur: px, of the edges."""

    uv: np.ndarray
    area: np.ndarray
    sigma: np.ndarray
    amplitude: np.ndarray
    solidity: np.ndarray
    blur: float


def fit_blobs(grey: np.ndarray, small: np.ndarray, step: int, regions: Regions) -> Blobs:
    """Bright markers of an image (H, W) uint8 in regions of the small image, reduced by step (1 or 2), by moments of weights that rise
    from ground to plateau on a marker's edge. Regions are grown by a pixel, except where two would meet."""
    found, blur = fit_regions(grey, small, regions.labels, regions.box, regions.centre, regions.label, step=step)
    return Blobs(found[:, :2], found[:, 2], found[:, 3], found[:, 4], found[:, 5], blur)
