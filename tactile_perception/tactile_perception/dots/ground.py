# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How the ground's brightness slopes about each dot, from the grounds that its neighbours were fitted with.

A slope fitted within a dot's own small window would cost up to half of the accuracy of its place; neighbours give it for nothing.
"""
from __future__ import annotations

import cv2
import numpy as np


def relative_slopes(u: np.ndarray, v: np.ndarray, ground: np.ndarray, good: np.ndarray, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Slopes of the ground along u and v at each dot, as shares of the ground a pixel; zero where fewer than four good neighbours are near.

    u, v, ground: (N,); good: (N,) bool, whose ground counts; cell: px, about the dots' pitch: a plane is fitted over three by three cells.
    """
    columns, rows = int(u.max() / cell) + 2, int(v.max() / cell) + 2
    at = np.clip((v / cell).astype(int), 0, rows - 1) * columns + np.clip((u / cell).astype(int), 0, columns - 1)
    level = max(float(np.median(ground)), 1.0)
    # coordinates about the cells' own centres would have to be moved when cells are added: about the image's centre they need not
    x, y, b = (u - u.mean()) / cell, (v - v.mean()) / cell, ground / level
    weight = good.astype(float)
    products = (weight, weight * x, weight * y, weight * b, weight * x * x, weight * x * y, weight * y * y, weight * x * b, weight * y * b)
    # one map under the other, a row of zeros between, so that one filter adds up the neighbours of all
    maps = np.zeros((len(products), rows + 1, columns), np.float64)
    for k, product in enumerate(products):
        maps[k, :rows] = np.bincount(at, product, rows * columns).reshape(rows, columns)
    near = cv2.boxFilter(maps.reshape(-1, columns), -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
    return _planes(*near.reshape(len(products), -1).take(at, axis=1), cell)


def _planes(n, sx, sy, sb, sxx, sxy, syy, sxb, syb, cell):
    enough = n > 3.5
    n = np.where(enough, n, 1.0)
    mx, my, mb = sx / n, sy / n, sb / n
    xx, xy, yy = sxx - n * mx * mx, sxy - n * mx * my, syy - n * my * my
    xb, yb = sxb - n * mx * mb, syb - n * my * mb
    determinant = xx * yy - xy * xy
    enough &= (determinant > 0.02 * n * n) & (mb > 1e-3)
    scale = np.where(enough, 1.0 / np.where(enough, determinant * mb * cell, 1.0), 0.0)
    return (yy * xb - xy * yb) * scale, (xx * yb - xy * xb) * scale
