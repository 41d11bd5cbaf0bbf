# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The current surface through the dots: cubic convolution between them, linear extrapolation beyond the last ones."""
from __future__ import annotations

from functools import lru_cache

import numpy as np

from .dot_grid import fill_unseen
from .vectors import cross
from ..errors import BadArgument

BEYOND = 2  # nodes extrapolated on each side, as a cubic needs
_SLOPE_STEP = 0.01  # pitches, of the finite differences
_AROUND = np.array([[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1]])
_FOUR = np.arange(4)


def cubic_weights(t: np.ndarray) -> np.ndarray:
    """(4, N) weights of the nodes -1, 0, 1, 2 at t (N,) in [0, 1] (Keys 1981, a = -1/2: exact for parabolas)."""
    square = t * t
    cube = square * t
    return np.array([2 * square - cube - t, 2 - 5 * square + 3 * cube, t + 4 * square - 3 * cube, cube - square]) * 0.5


@lru_cache(maxsize=256)
def between(nodes: int, refine: int) -> np.ndarray:
    """((nodes - 1) * refine + 1, nodes): weights of the nodes at places refine a node, by cubic convolution."""
    place = np.arange((nodes - 1) * refine + 1) / refine
    start = np.minimum(place.astype(int), nodes - 2)
    matrix = np.zeros((len(place), nodes))
    for step, weight in zip(range(-1, 3), cubic_weights(place - start)):
        np.add.at(matrix, (np.arange(len(place)), np.clip(start + step, 0, nodes - 1)), weight)
    return matrix


def refined(values: np.ndarray, refine: int) -> np.ndarray:
    """values (rows, columns, C) between their nodes, refine steps a node, by cubic convolution (Keys 1981)."""
    rows, columns, channels = values.shape
    tall = (between(rows, refine) @ values.reshape(rows, -1)).reshape(-1, columns, channels)
    return between(columns, refine) @ tall


def along_lines(fine: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Values (M, C) of fine (rows, columns, C) at places (M, 2) of (row, column) that lie on the lines between its nodes."""
    low = places.astype(int)
    rest = places - low
    first = low[:, 0] * fine.shape[1] + low[:, 1]
    second = first + (rest[:, 0] > 0) * fine.shape[1] + (rest[:, 1] > 0)
    flat = fine.reshape(-1, fine.shape[2])
    here = flat.take(first, axis=0)
    return here + rest.sum(axis=1)[:, None] * (flat.take(second, axis=0) - here)


def extended(values: np.ndarray) -> np.ndarray:
    """values (rows, columns, C) with BEYOND nodes more on every side, extrapolated linearly from the last two."""
    rows, columns, channels = values.shape
    wide = np.empty((rows + 2 * BEYOND, columns + 2 * BEYOND, channels))
    middle = wide[:, BEYOND:-BEYOND]
    middle[BEYOND:-BEYOND] = values
    for k in (1, 0):
        middle[k] = 2 * middle[k + 1] - middle[k + 2]
        middle[-1 - k] = 2 * middle[-2 - k] - middle[-3 - k]
    for k in (1, 0):
        wide[:, k] = 2 * wide[:, k + 1] - wide[:, k + 2]
        wide[:, -1 - k] = 2 * wide[:, -2 - k] - wide[:, -3 - k]
    return wide


def values_at(wide: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Values (M, C) by cubic convolution at places (M, 2) of (row, column), up to a pitch off the grid; wide: see extended."""
    last = np.array(wide.shape[:2]) - 2
    inside = np.minimum(np.maximum(places + BEYOND, 1), last)
    start = np.minimum(inside.astype(int), last - 1)
    weights = cubic_weights((inside - start).T)
    weights = (weights[:, 0].T[:, :, None] * weights[:, 1].T[:, None, :]).reshape(len(places), 1, 16)
    steps = (wide.shape[1] * _FOUR[:, None] + _FOUR).ravel()
    index = ((start[:, 0] - 1) * wide.shape[1] + start[:, 1] - 1)[:, None] + steps
    return (weights @ wide.reshape(-1, wide.shape[2]).take(index, axis=0))[:, 0]


class DotSurface:
    """The surface through dots at xyz (rows, columns, 3), m; unseen dots (NaN) are filled from their neighbours.

    xyz: the same without NaN; wide: see extended. Raises BadArgument for other shapes or where no dot is known.
    """

    def __init__(self, xyz: np.ndarray):
        if xyz.ndim != 3 or xyz.shape[2] != 3 or min(xyz.shape[:2]) < 2:
            raise BadArgument(f'dot surface: need xyz (rows, columns, 3), 2 x 2 dots or more, got {xyz.shape}')
        self.xyz = fill_unseen(xyz)
        if np.isnan(self.xyz[0, 0, 0]):
            raise BadArgument('dot surface: no dot is known')
        self.wide = extended(self.xyz)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the grid."""
        return self.xyz.shape[:2]

    def points(self, places: np.ndarray) -> np.ndarray:
        """Points (M, 3), m, at places (M, 2) of (row, column), up to a pitch off the grid."""
        return values_at(self.wide, places)

    def fine(self, row: int, column: int, shape: tuple[int, int], refine: int) -> np.ndarray:
        """Points (.., .., 3), m, refine a pitch, of shape rows and columns of nodes from (row, column) on, up to BEYOND off the grid."""
        return refined(self.wide[row + BEYOND:row + BEYOND + shape[0], column + BEYOND:column + BEYOND + shape[1]], refine)

    def place_and_normal(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The surface's point (3,), m, at xy (2,), m, seen along z, and its unit normal (3,), out of the sensor, as it slopes over a pitch
        on each side: Newton steps from the nearest dot."""
        off = self.xyz[..., :2] - xy
        place = np.array(divmod(int(np.argmin(np.einsum('ijk,ijk->ij', off, off))), self.shape[1]), float)
        found = self.points(place + _SLOPE_STEP * _AROUND[:3])[:, :2]
        (a, c), (b, d) = (found[1:] - found[0]) / _SLOPE_STEP
        inverse = np.array([[d, -b], [-c, a]]) / (a * d - b * c)  # the Jacobian is kept for both steps
        place = place + np.clip(inverse @ (xy - found[0]), -1, 1)
        place = place + np.clip(inverse @ (xy - self.points(place[None])[0, :2]), -1, 1)
        point, below, right, above, left = self.points(place + _AROUND)
        normal = cross(right - left, below - above)
        return point, normal / np.sqrt(normal @ normal)
