# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scores of one frame: labels by counts, regions by overlap on a raster, vectors (of which some axes may be unknown) by their errors."""
from __future__ import annotations

import cv2
import numpy as np
from scipy.stats import chi2


def f1(true_positive: int, false_positive: int, false_negative: int) -> float:
    """Harmonic mean of precision and recall; NaN where nothing was there and nothing was found."""
    total = 2 * true_positive + false_positive + false_negative
    return 2 * true_positive / total if total else np.nan


def counts(found: np.ndarray, there: np.ndarray, judged: np.ndarray | None = None) -> np.ndarray:
    """(3,) true positives, false positives, false negatives among judged entries; all arrays (N,) bool."""
    judged = np.ones(len(found), bool) if judged is None else judged
    return np.array([(found & there & judged).sum(), (found & ~there & judged).sum(), (~found & there & judged).sum()])


def label_f1(confusion: np.ndarray) -> np.ndarray:
    """(L,) f1 of each label; NaN for one that neither is there nor was found. confusion: (L, >= L) counts, true by found; columns beyond
    the labels are of what was not found at all."""
    labels = len(confusion)
    right, true, found = np.diag(confusion), confusion.sum(axis=1), confusion[:, :labels].sum(axis=0)
    return np.array([f1(r, f - r, t - r) for r, f, t in zip(right.tolist(), found.tolist(), true.tolist())])


def macro_f1(confusion: np.ndarray) -> float:
    """Mean of label_f1 over the labels that occur in truth; NaN where none does. confusion: (L, L), true by found."""
    occurring = confusion.sum(axis=1) > 0
    return float(label_f1(confusion)[occurring].mean()) if occurring.any() else np.nan


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


_FLAT = 1e-9  # of the largest variance: a direction with less is held by the sensor's shape, not estimated


def relative_errors(told: np.ndarray, true: np.ndarray) -> np.ndarray:
    """(N,) length of the error over the true length, both of the axes that are told (not NaN); inf where none is. told, true: (N, 3)."""
    known = np.isfinite(told)
    off, size = (np.linalg.norm(np.where(known, values, 0.0), axis=1) for values in (told - true, true))
    return np.where(known.any(axis=1), off / np.maximum(size, 1e-12), np.inf)


def normalised_square(error: np.ndarray, covariance: np.ndarray) -> tuple[float, int]:
    """Squared error over what the covariance lets expect, and the number of directions it is of: 1 a direction in the mean where the
    covariance is honest (normalised estimation error squared, Bar-Shalom et al., Estimation with applications, 2001, section 5.4).

    error: (3,); covariance: (3, 3). Directions in which the covariance is flat, as across the surface of a sphere, are left out. (NaN, 0)
    where either is not known, or the covariance is none.
    """
    if not (np.isfinite(error).all() and np.isfinite(covariance).all()):
        return np.nan, 0
    variances, axes = np.linalg.eigh(0.5 * (covariance + covariance.T))
    held = variances <= _FLAT * variances[-1]
    if variances[-1] <= 0 or variances[0] < -_FLAT * variances[-1]:
        return np.nan, 0
    along = axes.T @ error
    return float((along[~held]**2 / variances[~held]).sum()), int((~held).sum())


def honest_range(directions: int) -> tuple[float, float]:
    """Between which an honest normalised square over its directions lies in 95 % of cases."""
    return tuple((chi2.ppf([0.025, 0.975], directions) / directions).tolist())
