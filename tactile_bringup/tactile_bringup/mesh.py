# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Triangles that fill a region with holes. No ROS here."""
from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay, QhullError


def inside(points: np.ndarray, rings: list[np.ndarray]) -> np.ndarray:
    """(P,) whether points (P, 2) lie within an odd number of the closed rings, each (n, 2)."""
    odd = np.zeros(len(points), bool)
    x, y = points[:, 0, None], points[:, 1, None]
    for ring in rings:
        after = np.roll(ring, -1, axis=0)
        (x0, y0), (x1, y1) = ring.T[:, None], after.T[:, None]
        crossing = (y0 > y) != (y1 > y)
        with np.errstate(divide='ignore', invalid='ignore'):
            odd ^= (crossing & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))).sum(axis=1) % 2 == 1
    return odd


def fill(rings: list[np.ndarray], within: np.ndarray) -> np.ndarray:
    """Corners (3 T, 3), m, of triangles that fill outlines and holes (n, 3); within: (M, 3) further places on the surface."""
    if not rings:
        return np.zeros((0, 3))
    flat = [ring[:, :2] for ring in rings]
    corners = np.concatenate([*rings, within[inside(within[:, :2], flat)]])
    corners = np.unique(corners[np.isfinite(corners).all(axis=1)], axis=0)
    if len(corners) < 3:
        return np.zeros((0, 3))
    try:
        triangles = Delaunay(corners[:, :2]).simplices
    except QhullError:  # all on one line
        return np.zeros((0, 3))
    kept = triangles[inside(corners[triangles].mean(axis=1)[:, :2], flat)]
    return corners[kept].reshape(-1, 3)
