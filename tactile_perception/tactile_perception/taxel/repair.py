# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dead taxels: known, NaN, or silent while their neighbours are pressed; filled from their neighbours."""
from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from .._core import taxel_responding
from ..errors import BadArgument

_BOX = (3, 3)
_SILENT = 0.1  # of both neighbours, up to which a taxel is silent. Chosen: pressure blurred by the pad does not fall so far
_PRESSED = 12.0  # standard deviations of the noise, from which a taxel is pressed. Chosen
_FRAMES = 10  # silent frames, without any response before, after which a taxel is dead. Chosen


def dead_mask(shape: tuple[int, int], taxels: Sequence[int]) -> np.ndarray:
    """(rows, columns) bool from indices row * columns + column. Raises BadArgument for an index out of range."""
    mask = np.zeros(shape[0] * shape[1], bool)
    numbers = np.asarray(taxels, int).ravel()
    if numbers.size and (numbers.min() < 0 or numbers.max() >= mask.size):
        raise BadArgument(f'dead taxels: indices must be 0 to {mask.size - 1} (row * columns + column), got {numbers.tolist()}')
    mask[numbers] = True
    return mask.reshape(shape)


def fill(values: np.ndarray, dead: np.ndarray) -> np.ndarray:
    """values (rows, columns) float32 with dead (rows, columns) bool filled by the mean of live neighbours, from the rim of a gap inwards; 0
    where all are dead."""
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
    """Fills dead taxels and detects those that are silent between two pressed neighbours along a row or a column.

    known: (rows, columns) bool, dead from the start.
    """

    def __init__(self, known: np.ndarray):
        self.dead = known.copy()
        self._silent = np.zeros(known.shape, np.uint8)
        self._responded = np.zeros(known.shape, bool)

    def repaired(self, change: np.ndarray, sigma: float) -> np.ndarray:
        """change (rows, columns) float32 from the baseline with dead and NaN taxels filled; sigma: its noise."""
        self._responded, silent = taxel_responding(change, self._responded, pressed=_PRESSED * sigma, part=_SILENT)
        if silent.any():
            self._silent[silent] = np.minimum(self._silent[silent] + 1, _FRAMES)
            self.dead |= self._silent >= _FRAMES
        return fill(change, self.dead | np.isnan(change))
