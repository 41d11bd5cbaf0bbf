# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Robust statistics."""
from __future__ import annotations

import math

import numpy as np

SIGMA_PER_MAD = 1.4826  # standard deviation of normal errors over their median absolute deviation: 1 / (upper quartile of N(0, 1))


def upper_median(values: np.ndarray) -> float:
    """The upper of the two middle values (N,), N > 0; np.median takes several times as long for a few hundred."""
    return float(np.partition(values, len(values) // 2)[len(values) // 2])


def robust_sigma(residuals: np.ndarray, axis: int | None = None) -> np.ndarray | float:
    """Standard deviation of residuals around zero along axis (None: of all), from their median absolute value (Hampel 1974)."""
    return SIGMA_PER_MAD * np.median(np.abs(residuals), axis=axis)


_ERF = np.frompyfunc(math.erf, 1, 1)


def normal_cdf(x: np.ndarray) -> np.ndarray:
    """Standard normal distribution function of each x."""
    return 0.5 + 0.5 * _ERF(np.asarray(x) / math.sqrt(2)).astype(float)
