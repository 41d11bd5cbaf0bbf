# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Area, first and second moments of a region on the curved surface through the dots, from its polygons alone (Green's theorem)."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .dot_surface import BEYOND, DotSurface, values_at
from .grid_surface import cross
from .outline import Outline

# Channels of the integrand, per unit of area in (row, column).
_AREA, _VECTOR, _FIRST, _SECOND = 0, slice(1, 4), slice(4, 7), slice(7, 10)


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

    @property
    def centroid(self) -> np.ndarray:
        """(3,) m: the area centroid."""
        return self.first / self.area

    @property
    def normal(self) -> np.ndarray:
        """(3,) unit: mean normal, out of the sensor."""
        return self.vector_area / np.linalg.norm(self.vector_area)

    @property
    def spread(self) -> np.ndarray:
        """(2, 2) m^2: variances of x and y over the region."""
        xx, xy, yy = self.second / self.area
        x, y = self.centroid[:2]
        return np.array([[xx - x * x, xy - x * y], [xy - x * y, yy - y * y]])


class MomentField:
    """The integrands over one frame's surface, once for all its regions: the part of it that the outlines, at least one, take.

    pitch: mean distance of neighbouring dots, m.
    """

    def __init__(self, surface: DotSurface, outlines: list[Outline]):
        places = np.concatenate([outline.grid_points for outline in outlines])
        corner, wide = [], surface.wide
        for axis, (least, most) in enumerate(zip(places.min(axis=0), places.max(axis=0))):
            start = min(max(int(least), 0), surface.shape[axis] - 2)
            wide = np.take(wide, range(start, min(int(most) + 2, surface.shape[axis]) + 2 * BEYOND), axis)
            corner.append(start)
        self._corner = np.array(corner)
        vector = cross(_slope(wide, 1), _slope(wide, 0))
        density = np.sqrt(np.einsum('ijk,ijk->ij', vector, vector))[..., None]
        self.pitch = float(np.sqrt(density.mean()))
        x, y = wide[..., :1], wide[..., 1:2]
        channels = np.concatenate([np.ones_like(x), vector / np.maximum(density, 1e-30), wide, x * x, x * y, y * y], axis=2) * density
        # Integrated along the columns once; a contour integral over the rows then gives the double integral.
        half = 0.5 * (channels[:, 1:] + channels[:, :-1])
        self._along = np.concatenate([np.zeros_like(half[:, :1]), np.cumsum(half, axis=1)], axis=1)

    def of(self, outline: Outline) -> Moments:
        """Moments of one region, its holes taken off."""
        total = sum(self._around(loop) for loop in (outline.grid_points, *outline.grid_holes))
        return Moments(float(total[_AREA]), total[_VECTOR], total[_FIRST], total[_SECOND])

    def _around(self, loop: np.ndarray) -> np.ndarray:
        after = np.concatenate([loop[1:], loop[:1]])
        return (after[:, 0] - loop[:, 0]) @ values_at(self._along, 0.5 * (loop + after) - self._corner)


def _slope(wide: np.ndarray, axis: int) -> np.ndarray:
    """Central differences of wide (rows, columns, C) along axis, one-sided at its ends."""
    line = wide.swapaxes(axis, 0)
    slope = np.empty_like(line)
    slope[1:-1] = 0.5 * (line[2:] - line[:-2])
    slope[0], slope[-1] = line[1] - line[0], line[-1] - line[-2]
    return slope.swapaxes(0, axis)
