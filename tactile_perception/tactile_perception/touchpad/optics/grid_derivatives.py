# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Derivatives on the printed grid: surface normals, discrete Laplacian, smoothing."""
from __future__ import annotations

import cv2
import numpy as np

from ...common.vectors import cross, dot

BINOMIAL = np.float32([0.25, 0.5, 0.25])  # float32: OpenCV is seven times slower with float64


def laplacian(grid: np.ndarray) -> np.ndarray:
    """Discrete Laplacian, per pitch squared, of grid (rows, columns); 0 where a neighbour is missing."""
    out = np.zeros_like(grid)
    inner = grid[:-2, 1:-1] + grid[2:, 1:-1]
    inner += grid[1:-1, :-2]
    inner += grid[1:-1, 2:]
    inner -= 4 * grid[1:-1, 1:-1]
    out[1:-1, 1:-1] = np.where(np.isfinite(inner), inner, 0)
    return out


def smooth(grid: np.ndarray) -> np.ndarray:
    """Binomial 3 x 3 mean of grid (rows, columns) over known neighbours; NaN where all nine are missing."""
    known = np.isfinite(grid)
    if known.all():
        return cv2.sepFilter2D(grid, -1, BINOMIAL, BINOMIAL, borderType=cv2.BORDER_REPLICATE)
    both = cv2.merge([np.where(known, grid, 0), known.astype(grid.dtype)])
    both = cv2.sepFilter2D(both, -1, BINOMIAL, BINOMIAL, borderType=cv2.BORDER_CONSTANT)
    weight = both[..., 1]
    return np.where(weight > 0, both[..., 0] / np.maximum(weight, 1e-9), np.nan)


def normals(places: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    """Unit normals (3, rows, columns), z up, of the surface through places (3, rows, columns); otherwise (3, rows, columns) at the border
    of the grid and where neighbours are missing."""
    found = cross(places[:, 1:-1, 2:] - places[:, 1:-1, :-2], places[:, 2:, 1:-1] - places[:, :-2, 1:-1])
    found /= np.copysign(np.sqrt(dot(found, found)), found[2])
    out = otherwise.copy()
    np.copyto(out[:, 1:-1, 1:-1], found, where=np.isfinite(found[0]))
    return out
