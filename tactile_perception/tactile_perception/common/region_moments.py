# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Area, first and second moments of a region on the curved surface through the dots, and what follows from them."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

import numpy as np

from .. import _core


@dataclass(frozen=True)
class Moments:
    """Integrals over a region of the surface; regions add up with +.

    area: m^2; vector_area: (3,) m^2, normal times area; first: (3,) m^3, of x, y, z; second: (3,) m^4, of xx, xy, yy.
    """

    area: float
    vector_area: np.ndarray
    first: np.ndarray
    second: np.ndarray

    def __add__(self, other: Moments) -> Moments:
        return Moments(self.area + other.area, self.vector_area + other.vector_area, self.first + other.first, self.second + other.second)

    @cached_property
    def centroid(self) -> np.ndarray:
        """(3,) m: the area centroid."""
        return self.first / self.area

    @cached_property
    def normal(self) -> np.ndarray:
        """(3,) unit: mean normal, out of the sensor."""
        return self.vector_area / np.sqrt(self.vector_area @ self.vector_area)

    @property
    def spread(self) -> np.ndarray:
        """(2, 2) m^2: variances of x and y over the region."""
        xx, xy, yy = self.second / self.area
        x, y = self.centroid[:2]
        return np.array([[xx - x * x, xy - x * y], [xy - x * y, yy - y * y]])


def joined(loops: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (M, C) of polygons, and the first one of each, and M, (L + 1,)."""
    start = np.array([0, *accumulate(len(loop) for loop in loops)], np.int64)
    return (loops[0] if len(loops) == 1 else np.concatenate(loops)), start


def axes(moments: Moments, loops: list[np.ndarray], pitch: float) -> tuple[float, float, float]:
    """Full lengths (m) of the ellipse of the same moments, and its direction (rad), NaN where it is not significant against the errors of
    the outline and holes loops, (M, 3) each."""
    sums = np.array([moments.area, *moments.first[:2].tolist(), *moments.second.tolist()])
    return tuple(_core.region_axes(sums, *joined(loops), pitch=pitch).tolist())
