# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The current surface through the dots: cubic convolution between them, linear extrapolation beyond the last ones."""
from __future__ import annotations

import numpy as np

from .. import _core
from .dot_grid import fill_unseen
from ..errors import BadArgument

BEYOND = 2  # nodes extrapolated on each side, as a cubic needs


def extended(values: np.ndarray) -> np.ndarray:
    """values (rows, columns, C) with BEYOND nodes more on every side, extrapolated linearly from the last two."""
    rows, columns, channels = values.shape
    wide = np.empty((rows + 2 * BEYOND, columns + 2 * BEYOND, channels))
    middle = wide[:, BEYOND:-BEYOND]
    middle[BEYOND:-BEYOND] = values
    for k in (1, 0):
        middle[k] = 2 * middle[k + 1] - middle[k + 2]
        middle[-1 - k] = 2 * middle[-2 - k] - middle[-3 - k]
    for k in (1, 0):
        wide[:, k] = 2 * wide[:, k + 1] - wide[:, k + 2]
        wide[:, -1 - k] = 2 * wide[:, -2 - k] - wide[:, -3 - k]
    return wide


class DotSurface:
    """The surface through dots at xyz (rows, columns, 3), m; unseen dots (NaN) are filled from their neighbours.

    xyz: the same without NaN; wide: see extended. Raises BadArgument for other shapes or where no dot is known.
    """

    def __init__(self, xyz: np.ndarray):
        if xyz.ndim != 3 or xyz.shape[2] != 3 or min(xyz.shape[:2]) < 2:
            raise BadArgument(f'dot surface: need xyz (rows, columns, 3), 2 x 2 dots or more, got {xyz.shape}')
        self.xyz = fill_unseen(xyz)
        if np.isnan(self.xyz[0, 0, 0]):
            raise BadArgument('dot surface: no dot is known')
        self.wide = extended(self.xyz)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the grid."""
        return self.xyz.shape[:2]

    def points(self, places: np.ndarray) -> np.ndarray:
        """Points (M, 3), m, at places (M, 2) of (row, column), up to a pitch off the grid."""
        return _core.surface_points(self.wide, places)
