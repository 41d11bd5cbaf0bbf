# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The surface through printed dots: arrays on their grid, normals, interpolation, and regions on it with their moments."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

import cv2
import numpy as np

from .. import _core
from ..core.errors import BadArgument
from .constants import COMMON


def scatter(values: np.ndarray, ids: np.ndarray, count: int, unknown: float = np.nan, last: bool = False) -> np.ndarray:
    """(count, ...) array of values (N, ...) at ids (N,), unknown elsewhere; last: (..., count) of values (..., N)."""
    out = np.full((*values.shape[:-1], count) if last else (count, *values.shape[1:]), unknown, values.dtype)
    out[(..., ids) if last else ids] = values
    return out


def to_grid(ids: np.ndarray, values: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """(rows, columns, ...) float64 array of values (N, ...) at ids (N,) = row * columns + column; NaN for unseen dots.

    Raises BadArgument for ids that are off the grid or repeated.
    """
    ids = np.asarray(ids)
    seen = np.zeros(rows * columns, bool)
    if len(ids) and 0 <= ids.min() and ids.max() < rows * columns:
        seen[ids] = True
    if np.count_nonzero(seen) != len(ids):
        raise BadArgument(f'dot ids must be distinct, from 0 to {rows * columns - 1} ({rows} rows x {columns} columns)')
    values = np.asarray(values, float)
    grid = np.empty((rows * columns, *values.shape[1:]))
    grid[ids] = values
    if len(ids) < len(seen):
        grid[~seen] = np.nan
    return grid.reshape(rows, columns, *values.shape[1:])


def grid_normals(xyz: np.ndarray) -> np.ndarray:
    """Unit normals (rows, columns, 3) of the surface through xyz (rows, columns, 3), m, out of the sensor: by differences of neighbours,
    one-sided next to a gap; NaN without neighbours."""
    return _core.common.grid_normals(np.asarray(xyz, float))


def fill_unseen(grid: np.ndarray) -> np.ndarray:
    """grid (rows, columns, ...) with NaN entries filled layer by layer from their neighbours: interpolated or extrapolated linearly near
    known entries, by means farther away, where linear extrapolation amplifies errors. All NaN stays all NaN, a grid without NaN itself.
    """
    grid = np.asarray(grid, float)
    if np.isfinite(grid).all():
        return grid
    grid = grid.copy()
    layer = 0
    while np.isnan(grid).any():
        guess = _from_neighbours(grid, straight=layer < COMMON.straight_layers)
        layer += 1
        hole = np.isnan(grid) & ~np.isnan(guess)
        if not hole.any():
            break
        grid[hole] = guess[hole]
    return grid


def _from_neighbours(grid: np.ndarray, straight: bool) -> np.ndarray:
    """Mean over both axes of each node's prediction: between two neighbours, else (straight) linear from two, else the nearest."""
    total, count = np.zeros_like(grid), np.zeros(grid.shape)
    for axis in (0, 1):
        wide = np.pad(grid, [(2, 2) if k == axis else (0, 0) for k in range(grid.ndim)], constant_values=np.nan)
        near = [wide.take(range(2 + step, 2 + step + grid.shape[axis]), axis) for step in (-2, -1, 1, 2)]
        between = 0.5 * (near[1] + near[2])
        lines = [2 * near[1] - near[0], 2 * near[2] - near[3]] if straight else []
        guess = between
        for other in (*lines, near[1], near[2]):
            guess = np.where(np.isnan(guess), other, guess)
        known = ~np.isnan(guess)
        total[known] += guess[known]
        count += known
    return np.divide(total, count, out=np.full_like(grid, np.nan), where=count > 0)


class DotSurface:
    """The surface through dots at xyz (rows, columns, 3), m; unseen dots (NaN) are filled from their neighbours.

    xyz: the same without NaN; wide: (rows + 4, columns + 4, 3), with two nodes more on each side, extrapolated linearly from the last two.
    Raises BadArgument where no dot is known.
    """

    def __init__(self, xyz: np.ndarray):
        self.xyz = fill_unseen(xyz)
        if np.isnan(self.xyz[0, 0, 0]):
            raise BadArgument('dot surface: no dot is known')
        self.wide = _core.common.extend_surface(self.xyz)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the grid."""
        return self.xyz.shape[:2]


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


def joined(loops: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (M, C) of polygons, and the first one of each, and M, (L + 1,)."""
    start = np.array([0, *accumulate(len(loop) for loop in loops)], np.int64)
    return (loops[0] if len(loops) == 1 else np.concatenate(loops)), start


def axes(moments: Moments, loops: list[np.ndarray], pitch: float) -> tuple[float, float, float]:
    """Full lengths (m) of the ellipse of the same moments, and its direction (rad), NaN where it is not significant against the errors of
    the outline and holes loops, (M, 3) each."""
    sums = np.array([moments.area, *moments.first[:2].tolist(), *moments.second.tolist()])
    return tuple(_core.common.region_axes(sums, *joined(loops), pitch=pitch).tolist())


@dataclass(frozen=True)
class Outline:
    """One region: a closed polygon and the holes in it, in the sensor frame and on the grid (last vertex joins the first).

    points: (M, 3) m, M >= 3, turning from +x to +y; holes: list of (M, 3) m, turning from +y to +x; grid_points, grid_holes: the same
    vertices as (row, column), where a dot is at whole numbers.
    """

    points: np.ndarray
    holes: list[np.ndarray]
    grid_points: np.ndarray
    grid_holes: list[np.ndarray]

    @property
    def loops(self) -> list[np.ndarray]:
        """The outline and its holes, (M, 3) each."""
        return [self.points, *self.holes]


def label_score(contact: np.ndarray) -> np.ndarray:
    """Score (rows, columns), level 0.5, from labels: contact (rows, columns) of 0 and 1, NaN for unseen dots."""
    filled = np.clip(fill_unseen(contact), 0, 1)
    spread = np.float32(COMMON.label_spread)
    return cv2.sepFilter2D(filled, -1, spread, spread, borderType=cv2.BORDER_REPLICATE)


def region_outlines(score: np.ndarray, surface: DotSurface, level: float = 0.5) -> tuple[list[Outline], list[Moments], float]:
    """Regions where score (rows, columns) is above level, largest first: outlines on the surface, moments without the holes, and
    the mean distance of neighbouring dots, m, in the part of the surface that they cover.

    Unseen dots (NaN) are filled from their neighbours. score is clipped to 0 and 1, so that the border is independent of the pressure of an
    edge. Regions at the pattern's border are closed half a pitch outside the last dots.
    """
    found = _core.common.find_outlines(fill_unseen(score), surface.wide, level, COMMON.outline_steps)
    moments = [Moments(float(sums[0]), sums[1:4], sums[4:7], sums[7:]) for sums in found.moments]
    return grouped(found.vertices, found.points, found.start, found.region), moments, found.pitch


def grouped(vertices: np.ndarray, points: np.ndarray, start: np.ndarray, region: np.ndarray) -> list[Outline]:
    """Outlines with the holes that lie in them, from vertices (M, 2), points (M, 3), the first ones, and M, of the polygons start
    (L + 1,), and their regions (L,), as the kernels give them."""
    ends, outlines = start.tolist(), []
    for k, number in enumerate(region.tolist()):
        part = slice(ends[k], ends[k + 1])
        if number == len(outlines):
            outlines.append(Outline(points[part], [], vertices[part], []))
        else:
            outlines[number].holes.append(points[part])
            outlines[number].grid_holes.append(vertices[part])
    return outlines
