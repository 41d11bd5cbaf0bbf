# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The circle in which a ball touches the gel.

The slope of a ball is proportional to the distance from its deepest point, and so, to first order, is the change of each colour. The circle
is the one within which a plane in each colour explains most of the change: the most probable one for white noise.
"""
from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from scipy.fft import irfft2, next_fast_len, rfft2

from .constants import PHOTOMETRIC


class Circle(NamedTuple):
    """A circle in the working image. x, y, radius: px; evidence: the sum of squares of change that it explains."""

    x: float
    y: float
    radius: float
    evidence: float


class CircleSearch:
    """Finds the circle of a ball in changes of colour of one image shape (rows, columns)."""

    def __init__(self, shape: tuple[int, int]):
        self._reduced = max(shape[1] / 96, 1.0)  # px, of the images that are searched: the fit moves a centre by more than such a pixel
        self._size = round(shape[1] / self._reduced), round(shape[0] / self._reduced)
        columns, rows = self._size
        smallest, largest = PHOTOMETRIC.circle_radii
        margin = int(2 * largest * columns) + 1
        self._padded = next_fast_len(rows + margin), next_fast_len(columns + margin)
        self._radii = columns * np.exp(np.arange(np.log(smallest), np.log(largest), np.log(1.1)))  # from one radius to the next
        y, x = (np.fft.fftfreq(count, 1 / count).astype(np.float32) for count in self._padded)
        self._kernels = [self._kernels_of(x[None], y[:, None], radius) for radius in self._radii]

    def _kernels_of(self, x: np.ndarray, y: np.ndarray, radius: float) -> list[np.ndarray]:
        """Spectra of the three orthonormal functions of a plane on a disc."""
        disc = (x * x + y * y <= radius * radius).astype(np.float32)
        return [np.conj(rfft2(shape / np.sqrt((shape * shape).sum()))) for shape in (disc, disc * x, disc * y)]

    def find(self, change: np.ndarray, hidden: np.ndarray) -> Circle:
        """The most probable circle of a ball in changes (H, W, 3) of colour; hidden: (H, W) bool, pixels that show no skin."""
        seen = cv2.resize(change * ~hidden[..., None], self._size, interpolation=cv2.INTER_AREA)
        columns, rows = self._size
        spectrum = rfft2(seen.transpose(2, 0, 1), self._padded)
        best = Circle(np.nan, np.nan, np.nan, -1.0)
        for radius, kernels in zip(self._radii, self._kernels):
            explained = sum((irfft2(spectrum * kernel, self._padded)[:, :rows, :columns]**2).sum(axis=0) for kernel in kernels)
            row, column = np.unravel_index(np.argmax(explained), explained.shape)
            if explained[row, column] > best.evidence:
                best = Circle(self._full(column), self._full(row), radius * self._reduced, float(explained[row, column]))
        return best

    def _full(self, coordinate: int) -> float:
        """A coordinate in the working image of a pixel of the searched one."""
        return (coordinate + 0.5) * self._reduced - 0.5
