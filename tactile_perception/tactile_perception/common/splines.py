# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Interpolation by uniform cubic B-splines."""
from __future__ import annotations

import numpy as np


def spline_fit(levels: int) -> np.ndarray:
    """(levels + 3, levels + 1): from values at levels 0 to levels to coefficients of uniform cubic B-splines, not-a-knot ends."""
    rows = np.zeros((levels + 3, levels + 3))
    for k in range(levels + 1):
        rows[k, k:k + 3] = np.array([1, 4, 1]) / 6
    rows[-2, :5] = rows[-1, -5:] = [1, -4, 6, -4, 1]
    return np.linalg.inv(rows)[:, :levels + 1]
