# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Pairs of near image positions: sorted by row, each position is compared with the few that follow."""
from __future__ import annotations

import numpy as np


def near_pairs(u: np.ndarray, v: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (i, j) int64, each listed once, of positions u, v (N,) px, finite, less than `reach` px apart along both axes (in single
    precision)."""
    order = np.argsort(v)
    columns, rows = u.take(order).astype(np.float32), v.take(order).astype(np.float32)
    if len(rows) < 2:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    width = int((np.searchsorted(rows, rows + np.float32(reach)) - np.arange(len(rows))).max())
    near = np.abs(_following(columns, width) - columns[:, None]) < reach
    near &= _following(rows, width) - rows[:, None] < reach
    index = np.flatnonzero(near)
    i = index // width
    return order.take(i), order.take(index - i * (width - 1) + 1)


class PairList:
    """Neighbour list of positions that move from frame to frame, with a skin so that it is rebuilt only now and then.

    L. Verlet, Phys. Rev. 159, 98 (1967): while no two positions have moved relative to each other by more than the skin, no pair outside
    the list can be within reach.
    """

    def __init__(self, reach: float, skin: float):
        """reach: px, as in near_pairs(); skin: px, added to it."""
        self._reach, self._skin = reach, skin
        self._places = np.zeros((2, 0))

    def of(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pairs (i, j) int64 of positions (2, N) px, a superset of near_pairs(). The list is reused while positions keep their order."""
        if places.shape != self._places.shape or self._moved_apart(places):
            self._places, self._pairs = places, near_pairs(*places, self._reach + self._skin)
        return self._pairs

    def _moved_apart(self, places):
        moved = places - self._places
        return max(np.ptp(moved[0]), np.ptp(moved[1])) > self._skin


def _following(values, width):
    """(N, width) view of the values that follow each of values (N,); infinity after the last."""
    longer = np.full(len(values) + width + 1, np.inf, np.float32)
    longer[:len(values)] = values
    return np.ndarray((len(values), width), np.float32, longer, 4, (4, 4))
