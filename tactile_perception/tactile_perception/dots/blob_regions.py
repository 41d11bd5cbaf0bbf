# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where large bright markers are: regions of a small image above the mean around them, dots that touch told apart."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

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
    return median(some) if len(some) else 0.0


def median(values: np.ndarray) -> float:
    """The middle of values (N,), N > 0, the upper of two: np.median takes several times as long for a few hundred."""
    return float(np.partition(values, len(values) // 2)[len(values) // 2])
