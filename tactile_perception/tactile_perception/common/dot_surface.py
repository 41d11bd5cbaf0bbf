# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The current surface through the dots: cubic convolution between them, linear extrapolation beyond the last ones."""
from __future__ import annotations

import numpy as np

from .. import _core
from .dot_grid import fill_unseen
from ..errors import BadArgument

class DotSurface:
    """The surface through dots at xyz (rows, columns, 3), m; unseen dots (NaN) are filled from their neighbours.

    xyz: the same without NaN; wide: (rows + 4, columns + 4, 3), with two nodes more on each side, extrapolated linearly from the last two.
    Raises BadArgument for other shapes or where no dot is known.
    """

    def __init__(self, xyz: np.ndarray):
        if xyz.ndim != 3 or xyz.shape[2] != 3 or min(xyz.shape[:2]) < 2:
            raise BadArgument(f'dot surface: need xyz (rows, columns, 3), 2 x 2 dots or more, got {xyz.shape}')
        self.xyz = fill_unseen(xyz)
        if np.isnan(self.xyz[0, 0, 0]):
            raise BadArgument('dot surface: no dot is known')
        self.wide = _core.extend_surface(self.xyz)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the grid."""
        return self.xyz.shape[:2]

    def points(self, places: np.ndarray) -> np.ndarray:
        """Points (M, 3), m, at places (M, 2) of (row, column), up to a pitch off the grid."""
        return _core.surface_points(self.wide, places)
