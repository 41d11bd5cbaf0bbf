# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""RViz markers of the skin: shaded, half-transparent triangles between the dots, coloured by depth.

RViz neither lights nor blends by opacity triangles whose colours are one a triangle; with one a corner it blends, and the colours hold the
light.
"""
from __future__ import annotations

import numpy as np
from std_msgs.msg import ColorRGBA

from .. import colours, mesh

_DEPTHS, _SHADES = 32, 16  # steps of colour and shading, chosen: finer than the eye resolves
_OPACITY = 0.55  # chosen
_MOST = 300  # dots, chosen: rclpy converts each point and colour


def _palette() -> list[ColorRGBA]:
    """_DEPTHS * _SHADES colours, one row of shades per depth."""
    tones = colours.of_depth(np.linspace(0.0, 1.0, _DEPTHS))
    lit = tones[:, None] * np.linspace(0.0, 1.0, _SHADES)[:, None]
    return [ColorRGBA(r=r, g=g, b=b, a=_OPACITY) for r, g, b in lit.reshape(-1, 3).tolist()]


class SkinMarkers:
    """Triangulates the dots once and again when the set of dot ids changes."""

    def __init__(self):
        self._palette = _palette()
        self._id = np.zeros(0, np.int64)
        self._triangles = np.zeros((0, 3), np.int64)

    def corners(self, id: np.ndarray, places: np.ndarray, columns: int) -> list[int]:
        """Dot index of each triangle corner (3 T); id (N,) and places (N, 3), m, of the dots; columns of their grid, 0 without one.

        A grid of more than _MOST dots uses every other dot, as on the white squares of a chessboard.
        """
        if not np.array_equal(id, self._id):
            used = np.arange(len(id))
            if columns and len(id) > _MOST:
                used = np.flatnonzero((id // columns + id % columns) % 2 == 0)
            self._id, self._triangles = id, used[mesh.skin(places[used])]
        return self._triangles.ravel().tolist()

    def colours(self, places: np.ndarray, share: np.ndarray) -> list[ColorRGBA]:
        """Colour of each triangle corner; places (N, 3), m, and share (N,), the depths of the dots over the full depth."""
        depth = np.clip(np.round((_DEPTHS - 1) * share), 0, _DEPTHS - 1)
        shade = np.round((_SHADES - 1) * mesh.light(places, self._triangles))
        return [self._palette[k] for k in (_SHADES * depth + shade).astype(np.int64)[self._triangles.ravel()].tolist()]
