# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Lens undistortion with a check that the inverse of the distortion exists and was found."""
from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from .constants import DRIVER

_ZERO = np.zeros(3)


def undistorted(uv: np.ndarray, matrix: np.ndarray, distortion: np.ndarray) -> np.ndarray:
    """Undistorted normalised image coordinates (N, 2) of pixels uv (N, 2).

    matrix: (3, 3) K, px; distortion: (5,) k1 k2 p1 p2 k3 (Brown's model). NaN where uv is NaN, where uv lies beyond the radius at which
    the distortion folds back (no ray is imaged there), and where OpenCV's iteration does not converge.
    """
    pixels = np.ascontiguousarray(uv, float).reshape(-1, 1, 2)
    if not len(pixels):
        return np.zeros((0, 2))
    plane = cv2.undistortPoints(pixels, matrix, distortion).reshape(-1, 2)
    x = (pixels[:, 0, 0] - matrix[0, 2]) / matrix[0, 0]
    y = (pixels[:, 0, 1] - matrix[1, 2]) / matrix[1, 1]
    square = x * x + y * y
    seen = square < farthest_square(distortion)
    if not seen.all():
        plane[~seen] = np.nan
    wide = np.flatnonzero(seen & (square > DRIVER.verified_radius**2))
    if len(wide):
        again = cv2.projectPoints(np.column_stack([plane[wide], np.ones(len(wide))]), _ZERO, _ZERO, np.eye(3), distortion)[0]
        error = np.abs(again.reshape(-1, 2) - np.column_stack([x, y])[wide]).max(axis=1)
        plane[wide[~(error < DRIVER.max_reprojection_error * np.sqrt(square[wide]))]] = np.nan
    return plane


def farthest_square(distortion: np.ndarray) -> float:
    """Square of the normalised image radius up to which a lens with this distortion (5,) images rays; inf if there is no limit."""
    return _turning_square(*(float(distortion[k]) for k in (0, 1, 4)))


@lru_cache(maxsize=16)
def _turning_square(k1: float, k2: float, k3: float) -> float:
    """Square of the distorted radius, normalised, at the first maximum of r (1 + k1 r^2 + k2 r^4 + k3 r^6); inf without a maximum."""
    turns = [root.real for root in np.roots([7 * k3, 5 * k2, 3 * k1, 1.0]) if abs(root.imag) < 1e-9 and root.real > 0]
    if not turns:
        return np.inf
    square = min(turns)
    return square * (1 + square * (k1 + square * (k2 + square * k3)))**2
