# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Triangle meshes of a region with holes and of the skin between dots. Needs no ROS."""
from __future__ import annotations

import numpy as np

_LONGEST = 3.0  # times the median edge, chosen: longer edges bridge a notch in the border of the pattern
_AMBIENT = 0.35  # share of ambient light, chosen
_LIGHT = np.array([0.35, 0.25, 0.9]) / np.linalg.norm([0.35, 0.25, 0.9])  # direction to the light, chosen: oblique from above


def inside(points: np.ndarray, rings: list[np.ndarray]) -> np.ndarray:
    """Whether each of the points (P, 2) lies within an odd number of the closed rings, each (n, 2); (P,) bool."""
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
    """Corners (3 T, 3), m, of triangles that fill outlines less holes, each (n, 3); within: (M, 3) further points on the surface."""
    if not rings:
        return np.zeros((0, 3))
    flat = [ring[:, :2] for ring in rings]
    corners = np.concatenate([*rings, within[inside(within[:, :2], flat)]])
    corners = np.unique(corners[np.isfinite(corners).all(axis=1)], axis=0)
    triangles = _triangles(corners)
    kept = triangles[inside(corners[triangles].mean(axis=1)[:, :2], flat)]
    return corners[kept].reshape(-1, 3)


def skin(places: np.ndarray) -> np.ndarray:
    """Vertex indices (T, 3) of the triangles between places (N, 3), m, without long edges; triangulated in x and y."""
    triangles = _triangles(places)
    if not len(triangles):
        return triangles
    edges = np.linalg.norm(places[triangles] - places[np.roll(triangles, 1, axis=1)], axis=2)
    return triangles[edges.max(axis=1) < _LONGEST * np.median(edges)]


def _triangles(places: np.ndarray) -> np.ndarray:
    """Vertex indices (T, 3) of the Delaunay triangulation of places (N, 3), m, in x and y; (0, 3) for collinear places."""
    from scipy.spatial import Delaunay, QhullError  # imported only when markers are drawn
    if len(places) < 3:
        return np.zeros((0, 3), np.int64)
    try:
        return Delaunay(places[:, :2]).simplices.astype(np.int64)
    except QhullError:  # collinear
        return np.zeros((0, 3), np.int64)


def light(places: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Brightness (N,), 0 to 1, of a matt surface at its vertices (N, 3), m: ambient light and Lambert's cosine law."""
    a, b, c = places[triangles].transpose(1, 0, 2)
    faces = np.cross(b - a, c - a)
    faces *= np.where(faces[:, 2:] < 0, -1.0, 1.0)  # pointing outwards
    normals = np.zeros((len(places), 3))
    np.add.at(normals, triangles.ravel(), np.repeat(faces, 3, axis=0))
    cosine = normals @ _LIGHT / np.maximum(np.linalg.norm(normals, axis=1), 1e-30)
    return _AMBIENT + (1 - _AMBIENT) * np.clip(cosine, 0.0, 1.0)
