# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Regions of large bright markers in a reduced image, and their subpixel position, size and shape
(kernels find_blob_regions, fit_blobs: src/dots/detect/blob_regions.cpp, blob_fit.cpp)."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ... import _core

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
    return Regions(*_core.find_blob_regions(mask, speck=_SPECK, least=_LEAST, most=_MOST))


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
    found, blur = _core.fit_blobs(grey, small, regions.labels, regions.box, regions.centre, regions.label, step=step)
    return Blobs(found[:, :2], found[:, 2], found[:, 3], found[:, 4], found[:, 5], blur)
