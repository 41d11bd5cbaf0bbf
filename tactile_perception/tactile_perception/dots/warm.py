# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Numbered dots of the next frame without a search: each is fitted where it is expected.

A dot keeps its number if all fits together allow it. What a fit at an expected place cannot see is a move of the pattern by whole
pitches. At the pattern's edge it shows: of one outer row no dot is found again. And a part that moved by a whole pitch has a seam around
it where dots are lost. In doubt there is no answer, and the frame is searched as if it were the first.
"""
from __future__ import annotations

import numpy as np

from tactile_perception.common.dots import Dots
from tactile_perception.dots.index.follow import BEND, edges_found, torn

LOST_SHARE = 0.02  # of the dots seen last may not be found again, and FEW; an outer row is more
FEW = 2
SEARCHES = 10  # every so many frames are searched anew, for dots that nothing was known of


class WarmStart:
    """Where the dots of a printed grid of shape (rows, columns) are expected; detector: with refind(image, uv, area), see DotDetector."""

    def __init__(self, detector, shape: tuple[int, int]):
        self._detector, self._shape = detector, shape
        self.forget()

    def forget(self) -> None:
        """The next frame is searched."""
        count = self._shape[0] * self._shape[1]
        self._uv, self._move, self._area = np.full((count, 2), np.nan), np.zeros((count, 2)), np.full(count, np.nan)
        self._frames, self._pitch = SEARCHES, np.nan

    def remember(self, id: np.ndarray, uv: np.ndarray, area: np.ndarray, pitch: float) -> None:
        """The dots of a frame that was searched: id (N,) all different, uv (N, 2) px, area (N,) px^2, pitch px."""
        self._keep(id, uv, area)
        self._frames, self._pitch = 1, pitch

    def refind(self, image: np.ndarray) -> tuple[Dots, np.ndarray] | None:
        """Dots of the frame after those remembered and their numbers (N,); None if it has to be searched. Raises BadFrame."""
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
        """(count, 2) places and (count,) areas: those that were seen as they went on moving, others by their neighbours."""
        expected, area = self._uv + self._move, self._area
        missing = np.flatnonzero(np.isnan(area))
        if len(missing):
            expected[missing] = self._by_neighbours(expected, missing)
            area = np.where(np.isnan(area), np.nanmedian(area), area)
        return expected, area

    def _by_neighbours(self, places, missing):
        """(M, 2) places of missing dots on the lines through the two next dots each way, NaN where there are none."""
        rows, columns = self._shape
        grid = np.full((rows + 4, columns + 4, 2), np.nan)  # a margin of two, so that neighbours two away exist
        grid[2:-2, 2:-2] = places.reshape(rows, columns, 2)
        row, column = np.divmod(missing, columns)
        row, column = row + 2, column + 2
        ways = ((0, 1), (0, -1), (1, 0), (-1, 0))
        guess = np.stack([2 * grid[row + a, column + b] - grid[row + 2 * a, column + 2 * b] for a, b in ways])
        known = np.isfinite(guess)
        count = known.sum(0)
        return np.where(count, np.where(known, guess, 0.0).sum(0) / np.maximum(count, 1), np.nan)

    def _agree(self, id, uv):
        """Whether these dots are the ones that were seen last, each under its number."""
        move = np.full_like(self._uv, np.nan)
        move[id] = uv - self._uv[id]
        seen, again = np.count_nonzero(np.isfinite(self._uv[:, 0])), np.count_nonzero(np.isfinite(move[:, 0]))
        if seen - again > LOST_SHARE * seen + FEW:
            return False
        move = move.reshape(*self._shape, 2)
        return edges_found(np.isfinite(move[:, :, 0])) and not torn(move, BEND * self._pitch)
