# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How the ground's brightness slopes about each dot, from the grounds that its neighbours were fitted with.

A slope fitted within a dot's own small window would cost up to half of the accuracy of its place; neighbours give it for nothing.
"""
from __future__ import annotations

import cv2
import numpy as np

_FIRST, _SECOND = np.array([[0, 0, 0, 0, 1, 1, 2, 1, 2], [0, 1, 2, 3, 1, 2, 2, 3, 3]])  # of one, u, v, ground: which are multiplied
_SAME_LIGHT = 0.003  # of the ground, root mean square: changes less than that move no dot by 0.001 px
_DARK = 0.2  # grey levels: a darker ground has no slope
_MAPS = np.arange(9)[:, None]


class GroundSlopes:
    """Slopes of the ground along u and v as shares of the ground a pixel; zero where fewer than four good neighbours were near.

    u, v, ground: (N,) of dots; good: (N,) bool, whose ground counts; cell: px, about the dots' pitch: a plane is fitted over three by
    three cells.
    """

    def __init__(self, u: np.ndarray, v: np.ndarray, ground: np.ndarray, good: np.ndarray, cell: float):
        columns, rows = int(u.max() / cell) + 2, int(v.max() / cell) + 2
        self._cell, self._size, self._ground = cell, (rows, columns), ground
        at = self._cells(u, v)
        cells = rows * columns + columns  # a row of zeros after each map, so that one filter adds up the neighbours of all
        # coordinates about the cells' own centres would have to be moved when cells are added: about the image's centre they need not
        values = np.empty((4, len(u)))
        values[0], values[1], values[2], values[3] = 1.0, u / cell - columns / 2, v / cell - rows / 2, ground
        products = values[_FIRST] * values[_SECOND] * good
        maps = np.bincount((at + _MAPS * cells).ravel(), products.ravel(), len(products) * cells)
        near = cv2.boxFilter(maps.reshape(-1, columns), -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
        self._slopes = _planes(near.reshape(len(products), -1), cell)

    def hold_for(self, ground: np.ndarray) -> bool:
        """Whether dots with these grounds (N,), in the same order as those that the slopes are of, have the same light on them."""
        if len(ground) != len(self._ground):
            return False
        change = ground - self._ground
        return float(change @ change) < (_SAME_LIGHT * ground.mean()) ** 2 * len(ground)

    def at(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(2, N) slopes along u and v at places u, v (N,) px."""
        return self._slopes.take(self._cells(u, v), axis=1)

    def _cells(self, u, v):
        rows, columns = self._size
        row, column = np.minimum(np.maximum(v, 0) / self._cell, rows - 1), np.minimum(np.maximum(u, 0) / self._cell, columns - 1)
        return row.astype(np.int64) * columns + column.astype(np.int64)


def _planes(sums, cell):
    """(2, cells) slopes by the sums of products (9, cells) of one, u, v and ground."""
    enough = sums[0] > 3.5
    n = np.where(enough, sums[0], 1.0)
    mean = sums[1:4] / n
    xx, xy, yy, xb, yb = sums[4:] - n * mean[_FIRST[4:] - 1] * mean[_SECOND[4:] - 1]
    determinant = xx * yy - xy * xy
    enough &= (determinant > 0.02 * n * n) & (mean[2] > _DARK)
    scale = np.where(enough, 1.0 / np.where(enough, determinant * mean[2] * cell, 1.0), 0.0)
    return np.stack([yy * xb - xy * yb, xx * yb - xy * xb]) * scale
