# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How the ground's brightness slopes about each dot, from the grounds that its neighbours were fitted with.

A slope fitted within a dot's own small window would cost up to half of the accuracy of its place; neighbours give it for nothing.
"""
from __future__ import annotations

import cv2
import numpy as np

_FIRST, _SECOND = np.array([[0, 0, 0, 0, 1, 1, 2, 1, 2], [0, 1, 2, 3, 1, 2, 2, 3, 3]])  # of one, u, v, ground: which are multiplied
_MAPS = np.arange(9)[:, None]


def relative_slopes(u: np.ndarray, v: np.ndarray, ground: np.ndarray, good: np.ndarray, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Slopes of the ground along u and v at each dot, as shares of the ground a pixel; zero where fewer than four good neighbours are near.

    u, v, ground: (N,); good: (N,) bool, whose ground counts; cell: px, about the dots' pitch: a plane is fitted over three by three cells.
    """
    columns, rows = int(u.max() / cell) + 2, int(v.max() / cell) + 2
    cells = rows * columns + columns  # a row of zeros after each map, so that one filter adds up the neighbours of all
    at = (np.maximum(v, 0) / cell).astype(np.int64) * columns + (np.maximum(u, 0) / cell).astype(np.int64)
    # coordinates about the cells' own centres would have to be moved when cells are added: about the image's centre they need not
    values = np.stack([np.ones_like(u), (u - u.mean()) / cell, (v - v.mean()) / cell, ground / max(float(ground.mean()), 1.0)])
    products = values[_FIRST] * values[_SECOND] * good
    maps = np.bincount((at + _MAPS * cells).ravel(), products.ravel(), len(products) * cells)
    near = cv2.boxFilter(maps.reshape(-1, columns), -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
    return tuple(_planes(near.reshape(len(products), -1), cell).take(at, axis=1))


def _planes(sums, cell):
    """(2, cells) slopes by the sums of products (9, cells) of one, u, v and ground."""
    enough = sums[0] > 3.5
    n = np.where(enough, sums[0], 1.0)
    mean = sums[1:4] / n
    xx, xy, yy, xb, yb = sums[4:] - n * mean[_FIRST[4:] - 1] * mean[_SECOND[4:] - 1]
    determinant = xx * yy - xy * xy
    enough &= (determinant > 0.02 * n * n) & (mean[2] > 1e-3)
    scale = np.where(enough, 1.0 / np.where(enough, determinant * mean[2] * cell, 1.0), 0.0)
    return np.stack([yy * xb - xy * yb, xx * yb - xy * xb]) * scale
