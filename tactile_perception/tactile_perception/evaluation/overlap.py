# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Overlap of regions given by outlines and holes, counted on a raster."""
from __future__ import annotations

import cv2
import numpy as np

_PIXEL = 50e-6  # m
_MOST = 1200  # pixels along a side: larger regions are compared on a coarser raster


def region_iou(found: list[np.ndarray], there: list[np.ndarray]) -> float:
    """Intersection over union, seen along z, of the regions within two sets of loops (M, >= 2), m; NaN where both are empty.

    Outlines and holes alike are loops: what an odd number of them encloses is inside. The raster is of 50 um, coarser for regions of more
    than 60 mm.
    """
    corners = [loop[:, :2] for loop in (*found, *there) if len(loop) >= 3]
    if not corners:
        return np.nan
    low, high = np.vstack(corners).min(axis=0), np.vstack(corners).max(axis=0)
    pixel = _PIXEL * max(1, int(np.ceil((high - low).max() / (_PIXEL * _MOST))))
    origin = (np.floor(low / pixel) - 1) * pixel
    width, height = (np.ceil((high - origin) / pixel) + 2).astype(int).tolist()
    a, b = (_raster(loops, origin, pixel, (height, width)) for loops in (found, there))
    union = np.count_nonzero(a | b)
    return np.count_nonzero(a & b) / union if union else np.nan


def _raster(loops: list[np.ndarray], origin: np.ndarray, pixel: float, shape: tuple[int, int]) -> np.ndarray:
    image = np.zeros(shape, np.uint8)
    points = [np.round((loop[:, :2] - origin) / pixel * 16).astype(np.int32).reshape(-1, 1, 2) for loop in loops if len(loop) >= 3]
    if points:
        cv2.fillPoly(image, points, 1, shift=4)
    return image
