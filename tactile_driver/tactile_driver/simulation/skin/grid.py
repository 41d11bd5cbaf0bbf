# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What every simulated skin has in common: a square grid of nodes whose border is clamped, and the geometry of its cells."""
from __future__ import annotations

import numpy as np

#: cells along each side, about: a skin is drawn from no finer grid.
_DRAWN_CELLS = 48


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products (..., 3); several times as fast as NumPy's on the few thousand vectors of a skin."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape), a.dtype)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(a[..., j], b[..., k], out=out[..., i])
        out[..., i] -= a[..., k] * b[..., j]
    return out


class Skin:
    """n x n nodes, the border held.

    Attributes: nodes n; rest (n, n, 3), m; inner (n*n,) bool, nodes that are free to move; spacing m, between nodes, in the mean;
    tension N/m; pressure Pa, of what is enclosed, at rest; slack (m, 3) m, where the inner nodes would stand without any force, near rest.
    A skin also has: surface and square_of, between material places (..., 2) in [-1, 1]^2 and the rest shape; seen_at_rest, of rays;
    rim, its border as a line; touching_height, of a tool; give, compliance_among and fluid, of forces.
    """

    def __init__(self, rest: np.ndarray, tension: float):
        self.rest, self.tension, self.nodes = rest, tension, len(rest)
        border = np.zeros(rest.shape[:2], bool)
        border[[0, -1]] = border[:, [0, -1]] = True
        self.inner = ~border.ravel()
        self.spacing = float(np.sqrt(np.linalg.norm(self.area_vectors(rest), axis=1).sum()) / (self.nodes - 1))

    def area_vectors(self, xyz: np.ndarray) -> np.ndarray:
        """Outward area vectors (n*n, 3) of the nodes, m^2, of the shape xyz (n, n, 3), m."""
        cells = cross(xyz[1:, 1:] - xyz[:-1, :-1], xyz[1:, :-1] - xyz[:-1, 1:]) * xyz.dtype.type(0.125)
        out = np.zeros_like(xyz)
        out[:-1, :-1] += cells
        out[1:, :-1] += cells
        out[:-1, 1:] += cells
        out[1:, 1:] += cells
        return out.reshape(-1, 3)

    def volume_of(self, xyz: np.ndarray) -> float:
        """Enclosed volume, m^3, over the rim plane, of the shape xyz (n, n, 3), m."""
        cells = cross(xyz[1:, 1:] - xyz[:-1, :-1], xyz[1:, :-1] - xyz[:-1, 1:])
        height = xyz[:-1, :-1, 2] + xyz[1:, 1:, 2] + xyz[1:, :-1, 2] + xyz[:-1, 1:, 2]
        return float((cells[..., 2] * height).sum() / 8)

    def slack_at(self, shape: np.ndarray) -> np.ndarray:
        """Where the inner nodes would stand (m, 3), m, without any force, by what the rubber does in the shape (n, n, 3), m."""
        return self.slack

    def coarse(self, shape: np.ndarray) -> np.ndarray:
        """Every so manieth node of the shape (n, n, 3), m, as float32: enough to draw it, since light changes slowly."""
        every = max((self.nodes - 1) // _DRAWN_CELLS, 1)
        return shape[::every, ::every].astype(np.float32)

    def with_rim(self, places: np.ndarray) -> np.ndarray:
        """Shape (n, n, 3), m, of inner nodes' places (m, 3), m."""
        out = self.rest.copy()
        out[1:-1, 1:-1] = places.reshape(self.nodes - 2, self.nodes - 2, 3)
        return out
