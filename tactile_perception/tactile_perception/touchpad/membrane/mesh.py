# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The grid of dots as a mesh: neighbours."""
from __future__ import annotations

import numpy as np

from ...errors import BadArgument

_OFFSETS = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)]


class GridMesh:
    """Topology of a rows x columns grid of dots, K = rows * columns, dot k = row * columns + column.

    stencil (K, 9): a dot and its neighbours row by row, itself in slot 4 and for missing neighbours; valid (K, 9): where they exist; inner
    (K,): dots with eight neighbours. Raises BadArgument for less than 3 x 3 dots.
    """

    def __init__(self, rows: int, columns: int):
        if rows < 3 or columns < 3:
            raise BadArgument(f'membrane: a grid of at least 3 x 3 dots is needed, got {rows} x {columns}; '
                              'check parameters rows and columns')
        self.rows, self.columns, self.size = rows, columns, rows * columns
        self.stencil, self.valid = self._stencil()
        self.inner = self.valid.all(axis=1)

    def _stencil(self) -> tuple[np.ndarray, np.ndarray]:
        row, column = np.divmod(np.arange(self.size), self.columns)
        near_row = np.stack([row + i for i, _ in _OFFSETS], axis=1)
        near_column = np.stack([column + j for _, j in _OFFSETS], axis=1)
        valid = (near_row >= 0) & (near_row < self.rows) & (near_column >= 0) & (near_column < self.columns)
        return np.where(valid, near_row * self.columns + near_column, np.arange(self.size)[:, None]), valid
