# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The skin as RViz draws it: triangles between the dots, coloured by depth, shaded, half transparent.

RViz does not light triangles that have colours of their own, so that the light is in the colours. What costs time is that rclpy converts an
object for each point and each colour: so there is one colour a triangle, not one a corner.
"""
from __future__ import annotations

import numpy as np
from std_msgs.msg import ColorRGBA

from .. import colours, mesh

_DEPTHS, _SHADES = 32, 16  # steps of colour and of light: finer than is seen
_OPACITY = 0.55
_MOST = 300  # dots: 600 triangles take 2 ms to make and send, twice as many 6 ms


def _palette() -> list[ColorRGBA]:
    """_DEPTHS * _SHADES colours."""
    tones = colours.of_depth(np.linspace(0.0, 1.0, _DEPTHS))
    lit = tones[:, None] * np.linspace(0.0, 1.0, _SHADES)[:, None]
    return [ColorRGBA(r=r, g=g, b=b, a=_OPACITY) for r, g, b in lit.reshape(-1, 3).tolist()]


class SkinMarkers:
    """Triangles are those of the dots as they were first seen together; they are made anew when others are seen."""

    def __init__(self):
        self._palette = _palette()
        self._id = np.zeros(0, np.int64)
        self._triangles = np.zeros((0, 3), np.int64)

    def corners(self, id: np.ndarray, places: np.ndarray, columns: int) -> list[int]:
        """For each corner of the triangles (3 T) the index of its dot; id (N,) and places (N, 3), m: of the dots; columns: of their grid, 0
        for none. Of many dots on a grid every other one is used, as on the white squares of a chessboard."""
        if not np.array_equal(id, self._id):
            used = np.arange(len(id))
            if columns and len(id) > _MOST:
                used = np.flatnonzero((id // columns + id % columns) % 2 == 0)
            self._id, self._triangles = id, used[mesh.skin(places[used])]
        return self._triangles.ravel().tolist()

    def colours(self, places: np.ndarray, share: np.ndarray) -> list[ColorRGBA]:
        """A colour for each triangle; share: (N,) of the dots' depth over the full one."""
        depth = np.clip(np.round((_DEPTHS - 1) * share[self._triangles].mean(axis=1)), 0, _DEPTHS - 1)
        shade = np.round((_SHADES - 1) * mesh.light(places, self._triangles))
        return [self._palette[k] for k in (_SHADES * depth + shade).astype(np.int64).tolist()]
