# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From the change of colour to the slope of the skin: a polynomial in the three colours, whose coefficients vary over the image."""
from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from .constants import PHOTOMETRIC

#: Powers of blue, green and red, up to the third order: light that falls at an angle changes by its cosine, and shadows saturate.
_POWERS = [tuple(one.count(channel) for channel in range(3)) for order in (1, 2, 3)
           for one in combinations_with_replacement(range(3), order)]
#: Coefficients vary linearly with the two image coordinates, and those of the first order with their squares and product, too: the light
#: of near lamps is not even.
FEATURES = 3 * len(_POWERS) + 3 * 3


def features(change: np.ndarray, position: np.ndarray) -> np.ndarray:
    """(N, FEATURES) float32 of changes (N, 3) of colour at image positions (N, 2), which are -1 to 1 across the width."""
    powers = {channel: (None, values, values * values, values * values * values) for channel, values in enumerate(change.T)}
    found, count = np.empty((FEATURES, len(change)), np.float32), len(_POWERS)
    colour = found[:count]
    for row, orders in zip(colour, _POWERS):
        row[:] = 1.0
        for channel, order in enumerate(orders):
            if order:
                row *= powers[channel][order]
    x, y = position.T
    for k, part in enumerate((x, y), 1):
        np.multiply(colour, part, out=found[k * count:(k + 1) * count])
    for k, part in enumerate((x * x, x * y, y * y)):
        np.multiply(colour[:3], part, out=found[3 * (count + k):3 * (count + k + 1)])
    return found.T


def image_positions(shape: tuple[int, int]) -> np.ndarray:
    """(H, W, 2) float32 positions of the pixels, from the middle, in half widths."""
    rows, columns = shape
    y, x = np.mgrid[:rows, :columns].astype(np.float32)
    return np.stack([x - (columns - 1) / 2, y - (rows - 1) / 2], axis=-1) / (columns / 2)


@dataclass(frozen=True)
class NormalEquations:
    """Sums over pixels of a linear regression: they add up over presses, and a press can be left out of them.

    matrix: (FEATURES, FEATURES); right: (FEATURES, 2); count: pixels.
    """

    matrix: np.ndarray
    right: np.ndarray
    count: int

    @classmethod
    def of(cls, seen: np.ndarray, slope: np.ndarray) -> NormalEquations:
        """Of features (N, FEATURES) and true slopes (N, 2)."""
        seen = seen.astype(float)
        return cls(seen.T @ seen, seen.T @ slope, len(seen))

    def __add__(self, other: NormalEquations) -> NormalEquations:
        return NormalEquations(self.matrix + other.matrix, self.right + other.right, self.count + other.count)

    def __sub__(self, other: NormalEquations) -> NormalEquations:
        return NormalEquations(self.matrix - other.matrix, self.right - other.right, self.count - other.count)

    def solve(self) -> np.ndarray:
        """(FEATURES, 2) coefficients of the most probable polynomial."""
        return np.linalg.solve(self.matrix + PHOTOMETRIC.ridge * self.count * np.eye(len(self.matrix)), self.right)
