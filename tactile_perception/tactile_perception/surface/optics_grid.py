# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What neighbours on the printed grid tell: the surface's normal at a dot, and how a quantity bends around it."""
from __future__ import annotations

import cv2
import numpy as np

from .membrane_forces import cross

BINOMIAL = np.array([0.25, 0.5, 0.25])


def to_grid(values: np.ndarray, ids: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """Values (N, ...) of dots with numbers ids (N,) laid out as (rows, columns, ...); NaN where no dot was seen."""
    grid = np.full((rows * columns,) + values.shape[1:], np.nan)
    grid[ids] = values
    return grid.reshape((rows, columns) + values.shape[1:])


def bend(grid: np.ndarray) -> np.ndarray:
    """Sum of the second differences along rows and columns, per pitch squared, of grid (rows, columns); 0 where a neighbour is missing."""
    out = np.zeros_like(grid)
    out[1:-1, 1:-1] = grid[:-2, 1:-1] + grid[2:, 1:-1] + grid[1:-1, :-2] + grid[1:-1, 2:] - 4 * grid[1:-1, 1:-1]
    return np.nan_to_num(out, nan=0.0)


def smooth(grid: np.ndarray) -> np.ndarray:
    """Binomial 3x3 mean of grid (rows, columns); neighbours that are missing do not count; NaN stays only where all nine are missing."""
    known = np.isfinite(grid)
    both = np.dstack([np.where(known, grid, 0.0), known])
    total, weight = np.moveaxis(cv2.sepFilter2D(both, -1, BINOMIAL, BINOMIAL, borderType=cv2.BORDER_CONSTANT), 2, 0)
    return np.divide(total, weight, out=np.full_like(total, np.nan), where=weight > 0)


def normals(places: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    """Unit normals (rows, columns, 3), z up, of a surface through places (rows, columns, 3); `otherwise` where neighbours are missing."""
    first = np.ascontiguousarray(np.moveaxis(places, 2, 0))
    out = cross(_differences(first, 2), _differences(first, 1))
    out /= np.copysign(np.sqrt((out * out).sum(0)), out[2])
    return np.where(np.isfinite(out).all(0)[..., None], np.moveaxis(out, 0, 2), otherwise)


def _differences(places: np.ndarray, axis: int) -> np.ndarray:
    """Central differences along an axis of the grid, one-sided at its border."""
    grid = np.moveaxis(places, axis, 0)
    out = np.empty_like(grid)
    out[1:-1] = grid[2:] - grid[:-2]
    out[0], out[-1] = grid[1] - grid[0], grid[-1] - grid[-2]
    return np.moveaxis(out, 0, axis)
