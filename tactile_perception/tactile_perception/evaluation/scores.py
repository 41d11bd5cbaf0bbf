# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scores of one frame: F1 of labels, overlap of regions, errors over their covariance."""
from __future__ import annotations

import cv2
import numpy as np


def label_f1(confusion: np.ndarray) -> np.ndarray:
    """F1 score (L,) of each label, the harmonic mean of precision and recall; NaN for a label that is neither true nor estimated.

    confusion: (L, >= L) counts, true by estimated; columns beyond L count what was not estimated at all.
    """
    true, found = confusion.sum(axis=1), confusion[:, :len(confusion)].sum(axis=0)
    with np.errstate(invalid='ignore'):
        return 2 * np.diag(confusion) / (true + found)


def macro_f1(confusion: np.ndarray) -> float:
    """Mean F1 score of the labels that occur in the truth; NaN without one. confusion: (L, L), true by estimated."""
    occurring = confusion.sum(axis=1) > 0
    return float(label_f1(confusion)[occurring].mean()) if occurring.any() else np.nan


def region_iou(found: list[np.ndarray], there: list[np.ndarray]) -> float:
    """Intersection over union, in the x-y plane, of the regions enclosed by two sets of loops (M, >= 2), m; NaN for two empty regions.

    Outlines and holes are both loops: the interior is what an odd number of loops encloses (even-odd rule). The raster is 50 um,
    coarser for regions wider than 60 mm.
    """
    corners = [loop[:, :2] for loop in (*found, *there) if len(loop) >= 3]
    if not corners:
        return np.nan
    low, high = np.vstack(corners).min(axis=0), np.vstack(corners).max(axis=0)
    pixel, max_pixels = 50e-6, 1200  # m, and along a side
    pixel *= max(1, int(np.ceil((high - low).max() / (pixel * max_pixels))))
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


def normalised_square(error: np.ndarray, covariance: np.ndarray) -> tuple[float, int]:
    """Normalised estimation error squared, and its degrees of freedom: its mean over many frames is one per degree of freedom for
    consistent covariances (Bar-Shalom et al., Estimation with applications, 2001, section 5.4).

    error: (3,); covariance: (3, 3). Axes of unknown variance, such as the depth of a taxel array, and directions of zero variance, such as
    across the surface of a sphere, are left out. (NaN, 0) for an unknown error or covariance, and for a matrix that is not a covariance.
    """
    known = np.isfinite(np.diag(covariance))
    error, covariance = error[known], covariance[np.ix_(known, known)]
    if not (known.any() and np.isfinite(error).all() and np.isfinite(covariance).all()):
        return np.nan, 0
    variances, axes = np.linalg.eigh(0.5 * (covariance + covariance.T))
    fixed = 1e-9 * variances[-1]  # a direction with a smaller variance is fixed by the sensor's geometry, not estimated
    held = variances <= fixed
    if variances[-1] <= 0 or variances[0] < -fixed:
        return np.nan, 0
    along = axes.T @ error
    return float((along[~held]**2 / variances[~held]).sum()), int((~held).sum())
