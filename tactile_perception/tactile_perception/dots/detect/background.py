# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slope of the background brightness around each dot, from the fitted backgrounds of its neighbours.

Fitting a slope within each dot's own small window would cost up to half of the position's accuracy.
"""
from __future__ import annotations

import cv2
import numpy as np

_FIRST, _SECOND = np.array([[0, 0, 0, 0, 1, 1, 2, 1, 2], [0, 1, 2, 3, 1, 2, 2, 3, 3]])  # factors of each product, from (1, u, v, ground)
_SAME_LIGHT = 0.003  # RMS relative change of the background; smaller changes shift no dot by 0.001 px
_DARK = 0.2  # grey levels: a darker background gets slope zero. Chosen
_MAPS = np.arange(9)[:, None]


class GroundSlopes:
    """Background slopes along u and v as shares of the background per pixel; zero with fewer than four good neighbours.

    u, v: (N,) px and ground: (N,) grey levels, of the dots; good: (N,) bool, dots that are used; cell: px, about the dots' pitch. A plane
    is fitted to each block of three by three cells.
    """

    def __init__(self, u: np.ndarray, v: np.ndarray, ground: np.ndarray, good: np.ndarray, cell: float):
        columns, rows = int(u.max() / cell) + 2, int(v.max() / cell) + 2
        self._cell, self._size, self._ground = cell, (rows, columns), ground
        at = self._cells(u, v)
        cells = rows * columns + columns  # a row of zeros after each map, so that one filter sums all maps
        # coordinates from the image's centre need no shift when the sums of cells are added
        values = np.empty((4, len(u)))
        values[0], values[1], values[2], values[3] = 1.0, u / cell - columns / 2, v / cell - rows / 2, ground
        products = values[_FIRST] * values[_SECOND] * good
        maps = np.bincount((at + _MAPS * cells).ravel(), products.ravel(), len(products) * cells)
        near = cv2.boxFilter(maps.reshape(-1, columns), -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
        self._slopes = _planes(near.reshape(len(products), -1), cell)

    def hold_for(self, ground: np.ndarray) -> bool:
        """Whether the illumination is unchanged; ground: (N,) grey levels, of the same dots in the same order."""
        if len(ground) != len(self._ground):
            return False
        change = ground - self._ground
        return float(change @ change) < (_SAME_LIGHT * ground.mean()) ** 2 * len(ground)

    def at(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(2, N) slopes along u and v, shares of the background per pixel, at positions u, v (N,) px."""
        return self._slopes.take(self._cells(u, v), axis=1)

    def _cells(self, u, v):
        rows, columns = self._size
        row, column = np.minimum(np.maximum(v, 0) / self._cell, rows - 1), np.minimum(np.maximum(u, 0) / self._cell, columns - 1)
        return row.astype(np.int64) * columns + column.astype(np.int64)


def _planes(sums, cell):
    """(2, cells) slopes of least-squares planes, from sums (9, cells) of the products of 1, u, v and ground."""
    enough = sums[0] > 3.5
    n = np.where(enough, sums[0], 1.0)
    mean = sums[1:4] / n
    xx, xy, yy, xb, yb = sums[4:] - n * mean[_FIRST[4:] - 1] * mean[_SECOND[4:] - 1]
    determinant = xx * yy - xy * xy
    enough &= (determinant > 0.02 * n * n) & (mean[2] > _DARK)
    scale = np.where(enough, 1.0 / np.where(enough, determinant * mean[2] * cell, 1.0), 0.0)
    return np.stack([yy * xb - xy * yb, xx * yb - xy * xb]) * scale
