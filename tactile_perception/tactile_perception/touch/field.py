# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The markers of one frame as they appear in a metric plane: the one form in which all touch methods read them."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MarkerField:
    """One frame; K is the number of markers of the pattern, entry k belongs to marker k, NaN where it is not seen.

    rest, shift: (K, 2) m, untouched place and displacement as they appear in the viewing plane (where the ray from the eye to the marker
    meets it); growth: (K,) log of area there now over area untouched; eye: (K, 3) m, sensor frame, where the camera that sees the marker
    stands; sigma: (K,) m, standard deviation of shift per axis, NaN where not known; uv, duv: (K, 2) px, area: (K,) px^2: the same
    in the image.
    """

    rest: np.ndarray
    shift: np.ndarray
    growth: np.ndarray
    eye: np.ndarray
    sigma: np.ndarray
    uv: np.ndarray
    duv: np.ndarray
    area: np.ndarray

    def __len__(self) -> int:
        return len(self.rest)

    @property
    def seen(self) -> np.ndarray:
        """(K,) bool: markers with a known displacement."""
        return np.isfinite(self.shift).all(1)
