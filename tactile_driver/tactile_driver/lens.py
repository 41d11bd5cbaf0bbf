# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From pixels to the image that a lens without distortion would make."""
from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

_WIDE = 1.5  # normalised radius from which it is looked at whether the iteration has found the place
_FOUND = 1e-4  # of that radius
_STILL = np.zeros(3)


def undistorted(uv: np.ndarray, matrix: np.ndarray, distortion: np.ndarray) -> np.ndarray:
    """Places (N, 2) in the normalised image without distortion of image places uv (N, 2), px.

    matrix: (3, 3) K, px; distortion: (5,) k1 k2 p1 p2 k3 (Brown). NaN where uv is no number, or lies so far out that no ray can appear
    there: beyond the radius at which the distortion folds back, or where OpenCV's iteration does not find it.
    """
    pixels = np.ascontiguousarray(uv, float).reshape(-1, 1, 2)
    if not len(pixels):
        return np.zeros((0, 2))
    plane = cv2.undistortPoints(pixels, matrix, distortion).reshape(-1, 2)
    x = (pixels[:, 0, 0] - matrix[0, 2]) / matrix[0, 0]
    y = (pixels[:, 0, 1] - matrix[1, 2]) / matrix[1, 1]
    square = x * x + y * y
    seen = square < _farthest_square(float(distortion[0]), float(distortion[1]), float(distortion[4]))
    if not seen.all():
        plane[~seen] = np.nan
    wide = np.flatnonzero(seen & (square > _WIDE**2))
    if len(wide):
        again = cv2.projectPoints(np.column_stack([plane[wide], np.ones(len(wide))]), _STILL, _STILL, np.eye(3), distortion)[0]
        off = np.abs(again.reshape(-1, 2) - np.column_stack([x, y])[wide]).max(axis=1)
        plane[wide[~(off < _FOUND * np.sqrt(square[wide]))]] = np.nan
    return plane


@lru_cache(maxsize=16)
def _farthest_square(k1: float, k2: float, k3: float) -> float:
    """Square of the largest distorted radius, normalised, before the first at which it does not grow any more; inf where it always does."""
    turns = [root.real for root in np.roots([7 * k3, 5 * k2, 3 * k1, 1.0]) if abs(root.imag) < 1e-9 and root.real > 0]
    if not turns:
        return np.inf
    square = min(turns)
    return square * (1 + square * (k1 + square * (k2 + square * k3)))**2
