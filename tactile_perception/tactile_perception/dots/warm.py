# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Warm start: dots of the next frame fitted at their predicted positions, without detection.

Each dot keeps its index if the fits of all dots are consistent. A single fit cannot observe a shift by a whole pitch, but the grid can: a
shift of the whole pattern loses the dots of one outer row, and a shift of a part loses dots along its boundary. If the fits are
inconsistent, the frame is detected and indexed from scratch.
"""
from __future__ import annotations

import numpy as np

from tactile_perception.common.dots import Dots
from tactile_perception.dots.index.follow import BEND, edges_found, torn

# Of the n dots of the last frame, LOST_SHARE * n + FEW may be lost. Chosen: less than an outer row of a square grid of 3 to 47 rows
LOST_SHARE = 0.02
FEW = 2
SEARCHES = 10  # frames between full detections, which find dots not seen before. Chosen


class WarmStart:
    """Predicts and fits the dots of a printed grid.

    detector: an object with refind(image, uv, area), see DotDetector; shape: (rows, columns) of the grid.
    """

    def __init__(self, detector, shape: tuple[int, int]):
        self._detector, self._shape = detector, shape
        self.forget()

    def forget(self) -> None:
        """Forget all dots, so that the next frame is detected from scratch."""
        count = self._shape[0] * self._shape[1]
        self._uv, self._move, self._area = np.full((count, 2), np.nan), np.zeros((count, 2)), np.full(count, np.nan)
        self._frames, self._pitch = SEARCHES, np.nan

    def remember(self, id: np.ndarray, uv: np.ndarray, area: np.ndarray, pitch: float) -> None:
        """Store the dots of a detected frame: id (N,) unique, uv (N, 2) px, area (N,) px^2, pitch px."""
        self._keep(id, uv, area)
        self._frames, self._pitch = 1, pitch

    def refind(self, image: np.ndarray) -> tuple[Dots, np.ndarray] | None:
        """Dots of the next frame and their indices (N,); None if the frame must be detected from scratch. Raises BadFrame."""
        if self._frames >= SEARCHES:
            return None
        expected, area = self._expected()
        id = np.flatnonzero(np.isfinite(expected[:, 0]))
        found = self._detector.refind(image, expected[id], area[id])
        if found is None:
            return None
        dots, index = found
        id = id[index]
        if not self._agree(id, dots.uv):
            return None
        self._keep(id, dots.uv, dots.area)
        self._frames += 1
        return dots, id

    def _keep(self, id, uv, area):
        before = self._uv
        self._uv, self._area = np.full_like(before, np.nan), np.full_like(self._area, np.nan)
        self._uv[id], self._area[id] = uv, area
        self._move = self._uv - before
        self._move[np.isnan(self._move)] = 0.0

    def _expected(self):
        """Predicted positions (count, 2) and areas (count,): by constant velocity for dots seen last, from neighbours for the others."""
        expected, area = self._uv + self._move, self._area
        missing = np.flatnonzero(np.isnan(area))
        if len(missing):
            expected[missing] = self._by_neighbours(expected, missing)
            area = np.where(np.isnan(area), np.nanmedian(area), area)
        return expected, area

    def _by_neighbours(self, places, missing):
        """(M, 2) px, missing dots extrapolated linearly from the next two dots each way and averaged; NaN without such dots."""
        rows, columns = self._shape
        grid = np.full((rows + 4, columns + 4, 2), np.nan)  # a margin of two for the neighbours two steps away
        grid[2:-2, 2:-2] = places.reshape(rows, columns, 2)
        row, column = np.divmod(missing, columns)
        row, column = row + 2, column + 2
        ways = ((0, 1), (0, -1), (1, 0), (-1, 0))
        guess = np.stack([2 * grid[row + a, column + b] - grid[row + 2 * a, column + 2 * b] for a, b in ways])
        known = np.isfinite(guess)
        count = known.sum(0)
        return np.where(count, np.where(known, guess, 0.0).sum(0) / np.maximum(count, 1), np.nan)

    def _agree(self, id, uv):
        """Whether these dots are consistent with the last frame's dots of the same indices."""
        move = np.full_like(self._uv, np.nan)
        move[id] = uv - self._uv[id]
        seen, again = np.count_nonzero(np.isfinite(self._uv[:, 0])), np.count_nonzero(np.isfinite(move[:, 0]))
        if seen - again > LOST_SHARE * seen + FEW:
            return False
        move = move.reshape(*self._shape, 2)
        return edges_found(np.isfinite(move[:, :, 0])) and not torn(move, BEND * self._pitch)
