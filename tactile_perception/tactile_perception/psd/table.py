# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Functions of the place on the detector as a table of cells: looked up in a few array operations, whatever they cost to work out."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

CELLS = 128  # along each axis: interpolation between them adds under 0.02 degrees to a normal


class CellTable:
    """Bilinear interpolation of evaluate(places (N, 2)) -> (N, channels) over the square from -1 to 1; places beyond it are taken at
    its border."""

    def __init__(self, evaluate: Callable[[np.ndarray], np.ndarray], cells: int = CELLS):
        self._cells = cells
        line = np.linspace(-1, 1, cells + 1)
        corners = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
        values = evaluate(corners).reshape(cells + 1, cells + 1, -1)
        a, b, c, d = values[:-1, :-1], values[:-1, 1:], values[1:, :-1], values[1:, 1:]
        self.channels = values.shape[2]
        self._parts = np.stack([a, b - a, c - a, a - b - c + d], axis=2).reshape(cells * cells, 4, self.channels).copy()

    def look_up(self, place: np.ndarray) -> np.ndarray:
        """(N, channels) at places (N, 2), which have to be numbers."""
        parts, inside = self._found(place)
        s, t = inside[:, :1], inside[:, 1:]
        return parts[:, 0] + parts[:, 1] * s + (parts[:, 2] + parts[:, 3] * s) * t

    def with_slopes(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(channels,) at one place (2,), and their derivatives (channels, 2) by it."""
        (column, s), (row, t) = (self._cell(at) for at in place.tolist())
        start, by_x, by_y, by_both = self._parts[row * self._cells + column]
        along_x, along_y = by_x + by_both * t, by_y + by_both * s
        return start + by_x * s + along_y * t, 0.5 * self._cells * np.stack([along_x, along_y], axis=1)

    def look_up_one(self, place: np.ndarray, channel: int) -> np.ndarray:
        """(N,) one channel at places (N, 2)."""
        scaled = np.minimum(np.maximum((place + 1) * (0.5 * self._cells), 0.0), self._cells - 1e-9)
        cell = scaled.astype(np.intp)
        start, by_x, by_y, by_both = self._parts[cell[:, 1] * self._cells + cell[:, 0], :, channel].T
        s, t = (scaled - cell).T
        return start + by_x * s + (by_y + by_both * s) * t

    def _cell(self, at: float) -> tuple[int, float]:
        """(number of the cell along an axis, place within it, 0 to 1)."""
        scaled = min(max((at + 1) * 0.5 * self._cells, 0.0), self._cells - 1e-9)
        return int(scaled), scaled % 1.0

    def _found(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        scaled = np.minimum(np.maximum((place + 1) * (0.5 * self._cells), 0.0), self._cells - 1e-9)
        cell = scaled.astype(np.intp)
        return self._parts[cell[:, 1] * self._cells + cell[:, 0]], scaled - cell
