# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated plate: a weight rolls over it in a circle, is lifted, and comes back."""
from types import SimpleNamespace

import numpy as np

from tactile_driver.simulation.truth import Touch, TruthFrame

SIZE, NEWTONS_PER_COUNT, OFFSET = 0.3, 0.12, 12.0  # m between cells; N; counts of an unloaded cell
WEIGHT, RADIUS, LIFTED_S, ROUND_S = 20.0, 0.08, 1.0, 5.0  # N; m of the circle; s without the weight, and of all


class PlateScene:
    """Frames of four cells with their truth. rate: frames/s; seed: of the noise, one count."""

    sensor = 'plate'
    specimen = SimpleNamespace(rows=2, columns=2, thickness=0.01)

    def __init__(self, rate, seed):
        self.rate, self.frames, self._random = rate, round(ROUND_S * rate), np.random.default_rng(seed)

    def render(self, time):
        """Counts (2, 2) and truth at a time, s."""
        time = time % ROUND_S
        truth, loads = TruthFrame(), np.zeros((2, 2))
        if time >= LIFTED_S:
            x, y = RADIUS * np.cos(time), RADIUS * np.sin(time)
            left, top = 0.5 - x / SIZE, 0.5 + y / SIZE  # the lever rule on each pair of cells
            loads = WEIGHT * np.outer([top, 1 - top], [left, 1 - left])
            truth.contacts = [Touch(np.array([x, y, 0.0]), np.array([0.0, 0.0, 1.0]), np.nan, WEIGHT)]
        counts = OFFSET + loads / NEWTONS_PER_COUNT + self._random.normal(size=(2, 2))
        return np.clip(np.rint(counts), 0, 255).astype(np.uint8), truth
