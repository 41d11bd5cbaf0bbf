# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Base of the simulated skins: a square grid of nodes with a clamped border, and the geometry of its cells."""
from __future__ import annotations

import numpy as np

#: Approximate number of cells along each side of the grid used for rendering; chosen.
_DRAWN_CELLS = 48


def by_component(vectors: np.ndarray) -> np.ndarray:
    """The vectors (..., 3) with each component in one piece of memory: long sums and products take half the time."""
    return np.moveaxis(np.ascontiguousarray(np.moveaxis(vectors, -1, 0)), 0, -1)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products (..., 3); several times faster than NumPy's for the few thousand vectors of a skin."""
    out = np.empty_like(a, shape=np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(a[..., j], b[..., k], out=out[..., i])
        out[..., i] -= a[..., k] * b[..., j]
    return out


class Skin:
    """A skin of n x n nodes with a clamped border.

    Attributes: nodes: n; rest: (n, n, 3) m; inner: (n*n,) bool, the free nodes; spacing: m, mean distance of nodes; tension: N/m;
    pressure: Pa, gauge pressure of the enclosed fluid at rest; slack: (m, 3) m, force-free positions of the inner nodes, near rest.
    Subclasses also have surface and square_of (from material coordinates (..., 2) in [-1, 1]^2 to the rest shape and back), seen_at_rest
    (ray intersection), rim (border line), touching_height (of a tool), and give, compliance_among and fluid (response to forces).
    longest_step, longest_slide: node spacings that a tool may move, and move along the skin, in one step of contact; chosen.
    """

    longest_step, longest_slide = 0.95, np.inf

    def __init__(self, rest: np.ndarray, tension: float):
        self.rest, self.tension, self.nodes = rest, tension, len(rest)
        border = np.zeros(rest.shape[:2], bool)
        border[[0, -1]] = border[:, [0, -1]] = True
        self.inner = ~border.ravel()
        self.spacing = float(np.sqrt(np.linalg.norm(self.area_vectors(rest), axis=1).sum()) / (self.nodes - 1))

    def area_vectors(self, xyz: np.ndarray) -> np.ndarray:
        """Outward area vectors (n*n, 3), m^2, of the nodes of the shape xyz (n, n, 3), m."""
        cells = cross(xyz[1:, 1:] - xyz[:-1, :-1], xyz[1:, :-1] - xyz[:-1, 1:]) * xyz.dtype.type(0.125)
        out = np.zeros_like(xyz)
        out[:-1, :-1] += cells
        out[1:, :-1] += cells
        out[:-1, 1:] += cells
        out[1:, 1:] += cells
        return out.reshape(-1, 3)

    def volume_of(self, xyz: np.ndarray) -> float:
        """Volume, m^3, between the rim plane and the shape xyz (n, n, 3), m."""
        cells = cross(xyz[1:, 1:] - xyz[:-1, :-1], xyz[1:, :-1] - xyz[:-1, 1:])
        height = xyz[:-1, :-1, 2] + xyz[1:, 1:, 2] + xyz[1:, :-1, 2] + xyz[:-1, 1:, 2]
        return float((cells[..., 2] * height).sum() / 8)

    def slack_at(self, shape: np.ndarray, near: np.ndarray) -> tuple[np.ndarray, np.ndarray | float]:
        """Positions (k, 3), m, of the inner nodes near (k,) without contact, linearised at the shape (n, n, 3), m; and the forces (m, 3),
        N, or 0 for none, that move them there from slack."""
        return self.slack[near], 0.0

    def coarse(self, shape: np.ndarray) -> np.ndarray:
        """The shape (n, n, 3), m, subsampled for rendering, float32; light varies slowly, so this suffices."""
        every = max((self.nodes - 1) // _DRAWN_CELLS, 1)
        return shape[::every, ::every].astype(np.float32)

    def with_rim(self, places: np.ndarray) -> np.ndarray:
        """Shape (n, n, 3), m, from the positions (m, 3), m, of the inner nodes."""
        out = self.rest.copy()
        out[1:-1, 1:-1] = places.reshape(self.nodes - 2, self.nodes - 2, 3)
        return out
