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


def _following(values, width):
    """(N, width) the values that follow each of values (N,), infinity after the last."""
    longer = np.full(len(values) + width + 1, np.inf, np.float32)
    longer[:len(values)] = values
    return np.ndarray((len(values), width), np.float32, longer, 4, (4, 4))
