# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of vectors of which some axes may not be known."""
from __future__ import annotations

import numpy as np
from scipy.stats import chi2

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
