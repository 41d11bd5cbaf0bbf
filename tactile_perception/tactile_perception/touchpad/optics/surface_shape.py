# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Normals and curvature of the deformed surface at the dots, for their ranges by colour, kept between frames."""
from __future__ import annotations

import numpy as np

from ...common.dot_grid import scatter
from ...common.dots import DotTracks
from .grid_derivatives import laplacian, normals, smooth

_FRAMES = 3  # for which a shape is used; chosen
_NEAR, _MANY = 3e-4, 0.02  # m; chosen: or until more than this share of the dots has changed its range by more


class SurfaceShape:
    """The surface's shape, updated every few frames."""

    def __init__(self):
        self._age, self._id = _FRAMES, np.zeros(0, np.int64)

    def at(self, ranges: np.ndarray, rays: np.ndarray, centre: np.ndarray, rest, tracks: DotTracks) -> tuple[np.ndarray, np.ndarray]:
        """Unit normals (3, N) of the surface, and the Laplacian (N,), m per pitch squared, of the change of the ranges since rest.

        ranges: (N,) m, a first estimate, along rays (3, N) from centre (3, 1), m; rest: RestLight. Without a grid, the rest normals.
        """
        self._age += 1
        if not self._serves(ranges, tracks.id):
            self._age, self._id, self._ranges = 0, tracks.id, ranges
            self._found = self._find(ranges, rays, centre, rest, tracks)
        return self._found

    def _serves(self, ranges, id) -> bool:
        """Whether the last shape still holds for dots id (N,) at these ranges (N,)."""
        if self._age >= _FRAMES or not np.array_equal(id, self._id):
            return False
        return bool(np.count_nonzero(np.abs(ranges - self._ranges) > _NEAR) <= _MANY * len(id))

    @staticmethod
    def _find(ranges, rays, centre, rest, tracks):
        """As at, from smoothed ranges: derivatives amplify noise."""
        if tracks.rows < 3 or tracks.columns < 3:
            return rest.normals, np.zeros_like(ranges)
        def on_grid(values):
            return scatter(values, tracks.id, tracks.rows * tracks.columns, last=True).reshape(*values.shape[:-1], tracks.rows, -1)
        even = smooth(on_grid(ranges - rest.ranges))
        near = even.reshape(-1).take(tracks.id)
        places = centre + (rest.ranges + np.where(np.isfinite(near), near, np.float32(0))) * rays
        facing = normals(on_grid(places), on_grid(rest.normals)).reshape(3, -1).take(tracks.id, axis=1)
        return facing, laplacian(even).ravel().take(tracks.id)
