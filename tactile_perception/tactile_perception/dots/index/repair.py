# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The last step of indexing: indices for dots that are left where exactly as many places of the grid are."""
from __future__ import annotations

import numpy as np
from tactile_perception._core import assign_least

BENDS = 3.0  # largest second difference at completed nodes over the largest within NEAR rows and columns. Chosen
NEAR = 3  # rows and columns
MOST_SHARE = 0.2  # of the grid, most nodes that are completed; of more the order is not certain. Chosen


def complete_grid(id: np.ndarray, uv: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """id (N,) int64 of dots at uv (N, 2) px on a grid of shape (rows, columns), with
    the remaining dots (-1) indexed if there are exactly as many as free nodes and the grid stays smooth; else unchanged."""
    count = shape[0] * shape[1]
    loose, numbered = np.flatnonzero(id < 0), np.flatnonzero(id >= 0)
    if not len(loose) or len(id) != count or len(loose) > MOST_SHARE * count:
        return id
    missing = np.setdiff1d(np.arange(count), id[numbered])
    places = np.full((count, 2), np.nan)
    places[id[numbered]] = uv[numbered]
    bends = _bends(shape)
    places[missing] = _least_bent(places, bends, missing)
    first = places[missing]
    dot = assign_least(((first[:, None] - uv[loose])**2).sum(axis=2))
    dot = _exchange(places, bends, missing, uv[loose], dot)
    places[missing] = uv[loose[dot]]
    if _is_folded(places.reshape(*shape, 2)) or _bends_more(places, bends, missing, shape[1]):
        return id
    completed = id.copy()
    completed[loose[dot]] = missing
    return completed


def _bends(shape) -> np.ndarray:
    """(T, 3) indices of three successive nodes along rows and columns."""
    number = np.arange(shape[0] * shape[1]).reshape(shape)
    rows = np.stack([number[:, :-2], number[:, 1:-1], number[:, 2:]], axis=-1).reshape(-1, 3)
    columns = np.stack([number[:-2], number[1:-1], number[2:]], axis=-1).reshape(-1, 3)
    return np.vstack([rows, columns])


def _least_bent(places, bends, missing):
    """(M, 2) positions of missing nodes with the least second differences."""
    bends = bends[np.isin(bends, missing).any(axis=1)]
    unknown = np.full(len(places), -1)
    unknown[missing] = np.arange(len(missing))
    matrix, side = np.zeros((len(bends), len(missing))), np.zeros((len(bends), 2))
    for k, factor in enumerate((1.0, -2.0, 1.0)):
        at = unknown[bends[:, k]]
        free = at >= 0
        matrix[np.flatnonzero(free), at[free]] += factor
        side[~free] -= factor * places[bends[~free, k]]
    return np.linalg.lstsq(matrix, side, rcond=None)[0]


def _exchange(places, bends, missing, uv, dot):
    """The assignment dot (M,) of uv (M, 2) to missing nodes after pairwise exchanges that reduce the second differences."""
    bends = bends[np.isin(bends, missing).any(axis=1)]
    places, dot = places.copy(), dot.copy()

    def bending():
        """Sum of squared second differences of the present assignment, px^2."""
        places[missing] = uv[dot]
        a, b, c = places[bends.T]
        return ((a - 2 * b + c)**2).sum()

    least, better = bending(), True
    while better:
        better = False
        for i in range(len(dot)):
            for j in range(i):
                dot[[i, j]] = dot[[j, i]]
                energy = bending()
                if energy < least * (1 - 1e-9):
                    least, better = energy, True
                else:
                    dot[[i, j]] = dot[[j, i]]
    return dot


def _is_folded(grid) -> bool:
    """Whether any cell of positions (rows, columns, 2) is folded."""
    right, down = np.diff(grid, axis=1), np.diff(grid, axis=0)
    for r, d in ((right[:-1], down[:, :-1]), (right[:-1], down[:, 1:]), (right[1:], down[:, :-1]), (right[1:], down[:, 1:])):
        if (r[..., 0] * d[..., 1] - r[..., 1] * d[..., 0] <= 0).any():
            return True
    return False


def _bends_more(places, bends, missing, columns) -> bool:
    """Whether second differences at missing nodes exceed BENDS times those near them."""
    a, b, c = places[bends.T]
    size = np.hypot(*(a - 2 * b + c).T)
    new = np.isin(bends, missing).any(axis=1)
    apart = [np.abs(x[:, None] - y) for x, y in zip(np.divmod(bends[:, 1], columns), np.divmod(missing, columns))]
    near = (np.maximum(*apart) <= NEAR).any(axis=1) & ~new
    return bool(size[new].max(initial=0) > BENDS * size[near].max(initial=0))
