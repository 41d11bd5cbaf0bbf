# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The grid of dots as a mesh: triangles, the nine-dot stencil and the band in which the normal equations live."""
from __future__ import annotations

import cv2
import numpy as np

from ...errors import BadArgument

_OFFSETS = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)]


class GridMesh:
    """Topology of a rows x columns grid of dots, K = rows * columns, dot k = row * columns + column.

    triangles (3, T): each cell is cut along both diagonals, so that each triangle counts half and no direction is preferred;
    stencil (9, K): a dot and its neighbours, itself in slot 4 and for missing neighbours; around_index (8, K): the neighbours alone;
    inner (K,): dots with eight neighbours.
    Raises BadArgument for less than 3 x 3 dots.
    """

    def __init__(self, rows: int, columns: int):
        if rows < 3 or columns < 3:
            raise BadArgument(f'membrane: a grid of at least 3 x 3 dots is needed, got {rows} x {columns}; '
                              'check parameters rows and columns')
        self.rows, self.columns, self.size = rows, columns, rows * columns
        self.triangles = self._cut_cells()
        self.stencil, self.valid = self._stencil()
        self.inner = self.valid.all(0)
        self.around_index = np.delete(self.stencil, 4, axis=0)
        self.bandwidth = 2 * columns + 2
        self._place_triangles()
        self._place_band()

    def _cut_cells(self) -> np.ndarray:
        row, column = np.mgrid[:self.rows - 1, :self.columns - 1]
        a = (row * self.columns + column).ravel()
        b, c, d = a + 1, a + self.columns, a + self.columns + 1
        return np.concatenate([[a, b, c], [b, d, c], [a, b, d], [a, d, c]], axis=1)

    def _stencil(self) -> tuple[np.ndarray, np.ndarray]:
        row, column = np.divmod(np.arange(self.size), self.columns)
        near_row = np.array([row + i for i, _ in _OFFSETS])
        near_column = np.array([column + j for _, j in _OFFSETS])
        valid = (near_row >= 0) & (near_row < self.rows) & (near_column >= 0) & (near_column < self.columns)
        return np.where(valid, near_row * self.columns + near_column, np.arange(self.size)), valid

    def _place_triangles(self):
        """Index of corner pair (k, j) of each triangle in a (9, K) array: row dot k, slot of dot j."""
        row, column = np.divmod(self.triangles, self.columns)
        slot = (row[None] - row[:, None] + 1) * 3 + column[None] - column[:, None] + 1
        self.pair_index = (slot * self.size + self.triangles[:, None]).ravel()

    def _place_band(self):
        """Index of the products of stencil slots (a, b) of each inner dot in lower band storage (bandwidth + 1, K)."""
        self.slot_a, self.slot_b = np.triu_indices(9)
        low, high = self.stencil[self.slot_a], self.stencil[self.slot_b]
        index = (high - low) * self.size + low
        self.band_index = np.where(self.inner, index, 0).ravel()

    def to_pairs(self, values: np.ndarray) -> np.ndarray:
        """Values of corner pairs (3, 3, T) summed into the stencils of the dots, (9, K)."""
        return np.bincount(self.pair_index, values.ravel(), 9 * self.size).reshape(9, self.size)

    def transpose(self, rows: np.ndarray, factor: np.ndarray) -> np.ndarray:
        """Product (K,) of the transpose of a stencil matrix rows (9, K), zero off the inner dots, with a vector factor (K,)."""
        return np.bincount(self.stencil.ravel(), (rows * factor).ravel(), self.size)

    def normal_band(self, rows: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Lower band (bandwidth + 1, K) of J^T W J, J a stencil matrix (9, K), W = diag(weights), zero off the inner dots."""
        products = (rows * weights)[self.slot_a] * rows[self.slot_b]
        return np.bincount(self.band_index, products.ravel(), (self.bandwidth + 1) * self.size).reshape(-1, self.size)

    def neighbour_mean(self, values: np.ndarray) -> np.ndarray:
        """Mean (K,) of values (K,) over the dots left, right, above and below; nothing outside the grid counts as 0."""
        grid = np.zeros((self.rows + 2, self.columns + 2))
        grid[1:-1, 1:-1] = values.reshape(self.rows, self.columns)
        return ((grid[2:, 1:-1] + grid[:-2, 1:-1] + grid[1:-1, 2:] + grid[1:-1, :-2]) / 4).ravel()

    def around(self, values: np.ndarray) -> np.ndarray:
        """Sum (K,) of values (K,) over each dot and its eight neighbours; nothing outside the grid counts as 0."""
        grid = values.reshape(self.rows, self.columns)
        return cv2.boxFilter(grid, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT).ravel()

    def fill(self, values: np.ndarray, known: np.ndarray) -> np.ndarray:
        """values (K, n) with the rows where known (K,) is False replaced by the mean of their neighbours (Laplace's equation), in which
        unknown neighbours count half."""
        holes = np.flatnonzero(~known)
        filled = np.where(known[:, None], values, 0.0)
        if len(holes) == 0 or not known.any():
            return filled
        around = self.stencil[:, holes]
        weight = (self.valid[:, holes] & (np.arange(9) != 4)[:, None]) * np.where(known[around], 1.0, .5)
        slot, hole = np.nonzero((weight > 0) & ~known[around])
        matrix = np.diag(weight.sum(0))
        matrix[hole, np.searchsorted(holes, around[slot, hole])] = -.5
        filled[holes] = np.linalg.solve(matrix, (weight[..., None] * filled[around]).sum(0))
        return filled
