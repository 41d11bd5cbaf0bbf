# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Arrays of dot values on the printed grid: layout, surface normals, interpolation of unseen dots."""
from __future__ import annotations

import numpy as np

from .. import _core
from ..errors import BadArgument


_STRAIGHT_LAYERS = 2  # dots beyond the last known one that are extrapolated linearly; farther ones take means. Chosen


def scatter(values: np.ndarray, ids: np.ndarray, count: int, unknown: float = np.nan, last: bool = False) -> np.ndarray:
    """(count, ...) array of values (N, ...) at ids (N,), unknown elsewhere; last: (..., count) of values (..., N)."""
    out = np.full((*values.shape[:-1], count) if last else (count, *values.shape[1:]), unknown, values.dtype)
    out[(..., ids) if last else ids] = values
    return out


def to_grid(ids: np.ndarray, values: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """(rows, columns, ...) float64 array of values (N, ...) at ids (N,) = row * columns + column; NaN for unseen dots.

    Raises BadArgument for ids that are off the grid or repeated.
    """
    ids = np.asarray(ids)
    seen = np.zeros(rows * columns, bool)
    if len(ids) and 0 <= ids.min() and ids.max() < rows * columns:
        seen[ids] = True
    if np.count_nonzero(seen) != len(ids):
        raise BadArgument(f'dot ids must be distinct, from 0 to {rows * columns - 1} ({rows} rows x {columns} columns)')
    values = np.asarray(values, float)
    grid = np.empty((rows * columns, *values.shape[1:]))
    grid[ids] = values
    if len(ids) < len(seen):
        grid[~seen] = np.nan
    return grid.reshape(rows, columns, *values.shape[1:])


def grid_normals(xyz: np.ndarray) -> np.ndarray:
    """Unit normals (rows, columns, 3) of the surface through xyz (rows, columns, 3), m, out of the sensor: by differences of neighbours,
    one-sided next to a gap; NaN without neighbours."""
    return _core.grid_normals(np.asarray(xyz, float))


def fill_unseen(grid: np.ndarray) -> np.ndarray:
    """grid (rows, columns, ...) with NaN entries filled layer by layer from their neighbours: interpolated or extrapolated linearly near
    known entries, by means farther away, where linear extrapolation amplifies errors. All NaN stays all NaN, a grid without NaN itself.
    """
    grid = np.asarray(grid, float)
    if _core.all_within(grid):
        return grid
    grid = grid.copy()
    layer = 0
    while np.isnan(grid).any():
        guess = _from_neighbours(grid, straight=layer < _STRAIGHT_LAYERS)
        layer += 1
        hole = np.isnan(grid) & ~np.isnan(guess)
        if not hole.any():
            break
        grid[hole] = guess[hole]
    return grid


def _from_neighbours(grid: np.ndarray, straight: bool) -> np.ndarray:
    """Mean over both axes of each node's prediction: between two neighbours, else (straight) linear from two, else the nearest."""
    total, count = np.zeros_like(grid), np.zeros(grid.shape)
    for axis in (0, 1):
        near = [_shifted(grid, step, axis) for step in (-2, -1, 1, 2)]
        between = 0.5 * (near[1] + near[2])
        lines = [2 * near[1] - near[0], 2 * near[2] - near[3]] if straight else []
        guess = between
        for other in (*lines, near[1], near[2]):
            guess = np.where(np.isnan(guess), other, guess)
        known = ~np.isnan(guess)
        total[known] += guess[known]
        count += known
    return np.divide(total, count, out=np.full_like(grid, np.nan), where=count > 0)


def _shifted(grid: np.ndarray, step: int, axis: int) -> np.ndarray:
    out = np.full_like(grid, np.nan)
    length = grid.shape[axis]
    source = [slice(None)] * grid.ndim
    target = [slice(None)] * grid.ndim
    source[axis] = slice(max(step, 0), length + min(step, 0))
    target[axis] = slice(max(-step, 0), length + min(-step, 0))
    out[tuple(target)] = grid[tuple(source)]
    return out
