# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Area, first and second moments of a region on the curved surface through the dots, from its polygons (Green's theorem)."""
from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .contour import REFINE, Outline
from .vectors import cross
from .dot_surface import BEYOND, DotSurface, along_lines, refined

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


class MomentField:
    """The integrands over the part of one frame's surface that the outlines, at least one, cover; computed once for all regions.

    refine: as of the outlines. pitch: mean distance of neighbouring dots, m.
    """

    def __init__(self, surface: DotSurface, outlines: list[Outline], refine: int = REFINE):
        places = np.concatenate([outline.grid_points for outline in outlines])
        self._refine = refine
        # one node more on each side, where there is one, for the cubic
        first = np.maximum(np.floor(places.min(axis=0)).astype(int) - 1, 1 - BEYOND)
        last = np.minimum(np.ceil(places.max(axis=0)).astype(int) + 1, np.array(surface.shape) + BEYOND - 2)
        self._corner = first
        (top, left), (bottom, right) = first + BEYOND - 1, last + BEYOND + 2
        wide = surface.wide[top:bottom, left:right]
        vector = 0.25 * cross((wide[1:-1, 2:] - wide[1:-1, :-2]).T, (wide[2:, 1:-1] - wide[:-2, 1:-1]).T).T
        density = np.sqrt(np.einsum('ijk,ijk->ij', vector, vector))
        self.pitch = float(np.sqrt(density.mean()))
        channels = np.empty((*density.shape, 10))
        place = wide[1:-1, 1:-1]
        channels[..., _AREA] = density
        channels[..., _VECTOR] = vector
        channels[..., _FIRST] = place * density[..., None]
        channels[..., 7:9] = channels[..., 4:5] * place[..., :2]
        channels[..., 9] = channels[..., 5] * place[..., 1]
        # Integrated along the columns once; a contour integral over the rows then gives the double integral.
        along = np.zeros_like(channels)
        np.cumsum(0.5 * (channels[:, 1:] + channels[:, :-1]), axis=1, out=along[:, 1:])
        self._along = refined(along, refine)

    def of(self, outline: Outline) -> Moments:
        """Moments of one region without its holes."""
        total = sum(self._around(loop) for loop in (outline.grid_points, *outline.grid_holes))
        return Moments(float(total[_AREA]), total[_VECTOR], total[_FIRST], total[_SECOND])

    def _around(self, loop: np.ndarray) -> np.ndarray:
        """Contour integral (C,) over the rows, by the trapezoidal rule between vertices."""
        row = loop[:, 0]
        step = np.empty_like(row)
        step[1:-1], step[0], step[-1] = row[2:] - row[:-2], row[1] - row[-1], row[0] - row[-2]
        return 0.5 * step @ along_lines(self._along, (loop - self._corner) * self._refine)


# Standard deviation of an outline, and the correlation length of its errors, in pitches of the dots. Chosen.
OUTLINE_SIGMA = 0.3
OUTLINE_LENGTH = 1.0
# Standard deviations by which the two variances of a region with a direction differ (about 10 degrees uncertainty). Chosen.
_DIRECTION = 3.0


def axes(moments: Moments, loops: list[np.ndarray], pitch: float) -> tuple[float, float, float]:
    """Full lengths (m) of the ellipse of the same moments, and its direction (rad), NaN where it is not significant."""
    x, y = (moments.first[:2] / moments.area).tolist()
    xx, xy, yy = (moments.second / moments.area).tolist()
    xx, xy, yy = xx - x * x, xy - x * y, yy - y * y
    mean, half = 0.5 * (xx + yy), math.hypot(0.5 * (xx - yy), xy)
    major, minor = 4 * math.sqrt(max(mean + half, 0)), 4 * math.sqrt(max(mean - half, 0))
    angle = 0.5 * math.atan2(2 * xy, xx - yy)
    # Squares along and across, as the real part of a complex square.
    back = complex(math.cos(angle), -math.sin(angle))
    turned = [(np.ascontiguousarray(loop[:, :2]).view(complex) - complex(x, y)) * back for loop in loops]
    doubt = boundary_sd(loops, [(place * place).real for place in turned], pitch)[0] / moments.area
    if 2 * half < _DIRECTION * doubt:
        return major, minor, np.nan
    return major, minor, angle if angle > -0.5 * math.pi else 0.5 * math.pi


def boundary_sd(loops: list[np.ndarray], values: list[np.ndarray], pitch: float) -> np.ndarray:
    """Standard deviations (C,) of integrals over a region due to errors of its outline.

    loops: [(M, 3), ...] m, outline and holes; values: [(M, C), ...], the integrands there. Errors of
    OUTLINE_SIGMA pitches are independent for each OUTLINE_LENGTH pitches.
    """
    squares = sum(_side_lengths(loop) @ value**2 for loop, value in zip(loops, values))
    return OUTLINE_SIGMA * pitch * np.sqrt(OUTLINE_LENGTH * pitch * squares)


def _side_lengths(loop: np.ndarray) -> np.ndarray:
    side = np.concatenate([loop[1:], loop[:1]]) - loop
    return np.sqrt(np.einsum('ij,ij->i', side, side))
