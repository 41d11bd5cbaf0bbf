# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which places in an image are near one another: each is compared with the few that follow it from top to bottom."""
from __future__ import annotations

import numpy as np


def near_pairs(u: np.ndarray, v: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (i, j) int64, each once, of finite places u, v (N,) px that are less than `reach` px apart along both axes (to single
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
    """Near pairs of places that move from frame to frame, found a skin further out so that they are searched for only now and then.

    A neighbour list as L. Verlet's (Phys. Rev. 159, 98, 1967): as long as no two places moved against each other by more than the skin, no
    pair outside the list can have come near.
    """

    def __init__(self, reach: float, skin: float):
        """reach: of near_pairs(); skin: px."""
        self._reach, self._skin = reach, skin
        self._places = np.zeros((2, 0))

    def of(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pairs (i, j) int64 of places (2, N) px, among them all that near_pairs() finds; quick where they are in the last order."""
        if places.shape != self._places.shape or self._moved_apart(places):
            self._places, self._pairs = places, near_pairs(*places, self._reach + self._skin)
        return self._pairs

    def _moved_apart(self, places):
        moved = places - self._places
        return max(np.ptp(moved[0]), np.ptp(moved[1])) > self._skin


def _following(values, width):
    """(N, width) the values that follow each of values (N,), infinity after the last."""
    longer = np.full(len(values) + width + 1, np.inf, np.float32)
    longer[:len(values)] = values
    return np.ndarray((len(values), width), np.float32, longer, 4, (4, 4))
