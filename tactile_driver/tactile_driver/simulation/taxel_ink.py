# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The ink of a taxel array: from load to whole numbers, with gains, offsets, noise, hysteresis and dead rows."""
from __future__ import annotations

import numpy as np


class Ink:
    """shape: (rows, columns); seed: of its irregularities and noise; rate: frames/s; counts_per_pascal; bits; dead_rows: rows that stay
    0."""

    def __init__(self, shape: tuple[int, int], seed: int, rate: float, counts_per_pascal: float = 1 / 500, bits: int = 8,
                 dead_rows: tuple[int, ...] = ()):
        rng = np.random.default_rng([seed, 17])
        self._gain = counts_per_pascal * np.clip(rng.normal(1, 0.05, shape), 0.8, 1.2)
        self._offset = rng.gamma(1.2, 1.5, shape)
        self._noise = np.random.default_rng([seed, 23])
        self._largest, self._dead = 2**bits - 1, list(dead_rows)
        self._slack = 900.0  # Pa, by which the ink may lag behind
        self._creep = 1 - np.exp(-1 / (rate * 0.8))
        self._stuck = np.zeros(shape)

    def read(self, load: np.ndarray) -> np.ndarray:
        """(rows, columns) uint8 or uint16 of load (rows, columns), Pa."""
        self._stuck = np.clip(self._stuck, load - self._slack, load + self._slack)
        self._stuck += self._creep * (load - self._stuck)
        value = self._gain * np.maximum(self._stuck, 0) + self._offset + self._noise.normal(0, 0.6, load.shape)
        whole = np.clip(np.round(value), 0, self._largest)
        whole[self._dead] = 0
        return whole.astype(np.uint8 if self._largest < 256 else np.uint16)
