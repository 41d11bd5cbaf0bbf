# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dead taxels: those known, those that are NaN, and those that stay silent while their neighbours are pressed."""
from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from ..errors import BadArgument

_BOX = (3, 3)
# A blurred pressure cannot fall to this part of what it is on both sides of a taxel.
_SILENT = 0.1
_PRESSED = 12.0  # standard deviations of the noise: neighbours under more are pressed
_FRAMES = 10  # in which a taxel must have been silent, without ever having spoken, to be dead


def dead_mask(shape: tuple[int, int], taxels: Sequence[int]) -> np.ndarray:
    """(rows, columns) bool from numbers row * columns + column. Raises BadArgument for a number that is of no taxel."""
    mask = np.zeros(shape[0] * shape[1], bool)
    numbers = np.asarray(taxels, int).ravel()
    if numbers.size and (numbers.min() < 0 or numbers.max() >= mask.size):
        raise BadArgument(f'dead taxels: numbers must be 0 to {mask.size - 1} (row * columns + column), got {numbers.tolist()}')
    mask[numbers] = True
    return mask.reshape(shape)


def fill(values: np.ndarray, dead: np.ndarray) -> np.ndarray:
    """values (rows, columns) float32 with the dead ones (bool) as their live neighbours' mean, from the rim of a gap inwards; 0 where
    all are dead."""
    if not dead.any():
        return values
    known = (~dead).astype(np.float32)
    filled = np.where(dead, np.float32(0), values)
    for _ in range(max(values.shape)):
        weight = cv2.boxFilter(known, -1, _BOX, normalize=False, borderType=cv2.BORDER_CONSTANT)
        total = cv2.boxFilter(filled, -1, _BOX, normalize=False, borderType=cv2.BORDER_CONSTANT)
        new = (known == 0) & (weight > 0.5)
        if not new.any():
            break
        filled[new] = total[new] / weight[new]
        known[new] = 1
    return filled


class DeadTaxels:
    """Repairs frames, and finds taxels that are silent though both neighbours along a row or a column are pressed.

    known: (rows, columns) bool, dead from the first.
    """

    def __init__(self, known: np.ndarray):
        self.dead = known.copy()
        self._silent = np.zeros(known.shape, np.uint8)
        self._spoken = np.zeros(known.shape, bool)

    def repaired(self, change: np.ndarray, sigma: float) -> np.ndarray:
        """change (rows, columns) float32, of each taxel from its baseline, without gaps; sigma: standard deviation of its noise."""
        self._learn(change, np.float32(_PRESSED * sigma))
        return fill(change, self.dead | np.isnan(change))

    def _learn(self, change: np.ndarray, pressed: float) -> None:
        """Mark what is silent between pressed neighbours, which is little or nothing in most frames."""
        loud = change > pressed
        self._spoken |= loud
        between = np.zeros(change.shape, bool)
        between[1:-1] = loud[:-2] & loud[2:]
        between[:, 1:-1] |= loud[:, :-2] & loud[:, 2:]
        between &= ~self._spoken
        if not between.any():
            return
        bound, least = np.where(loud, change, np.float32(0)), np.zeros(change.shape, np.float32)
        least[1:-1] = np.minimum(bound[:-2], bound[2:])
        least[:, 1:-1] = np.maximum(least[:, 1:-1], np.minimum(bound[:, :-2], bound[:, 2:]))
        silent = between & (change < _SILENT * least)  # which a gap, NaN, is not
        self._silent[silent] = np.minimum(self._silent[silent] + 1, _FRAMES)
        self.dead |= self._silent >= _FRAMES
