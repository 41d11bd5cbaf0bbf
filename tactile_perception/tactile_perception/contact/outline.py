# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Outlines of contact regions: the half-level contour of what the dots say, between the dots, on the present surface."""
from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from ..errors import BadArgument
from .dot_surface import DotSurface, cubic_weights
from .grid_surface import fill_unseen

_TOP, _RIGHT, _BOTTOM, _LEFT = range(4)
# Segment of a cell by which corners are inside (1 top left, 2 top right, 4 bottom right, 8 bottom left): edge it comes from, edge it goes
# to, so that outlines turn from +column to +row. Cells with two diagonal corners (5, 10) have two: those of the pair of codes given,
# first where the middle is outside, then where it is inside.
_FROM = np.array([0, _TOP, _RIGHT, _RIGHT, _BOTTOM, 0, _BOTTOM, _BOTTOM, _LEFT, _TOP, 0, _RIGHT, _LEFT, _TOP, _LEFT, 0])
_TO = np.array([0, _LEFT, _TOP, _LEFT, _RIGHT, 0, _TOP, _LEFT, _BOTTOM, _BOTTOM, 0, _BOTTOM, _RIGHT, _RIGHT, _TOP, 0])
_SADDLES = {5: ((1, 4), (13, 7)), 10: ((2, 8), (14, 11))}
# A label spreads to its neighbours as a Gaussian of half a pitch: it rounds the steps that a grid makes of a slanted edge.
_LABEL_SPREAD = np.array([0.107, 0.786, 0.107])


@dataclass(frozen=True)
class Outline:
    """One region: a closed polygon and the holes in it, in the sensor frame and on the grid (last vertex joins the first).

    points: (M, 3) m, M >= 3, turning from +x to +y; holes: list of (M, 3) m, turning the other way; grid_points, grid_holes: the same
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
    """Score (rows, columns), level 0.5, from labels alone: contact (rows, columns) of 0 and 1, NaN where no dot was seen."""
    filled = np.clip(fill_unseen(contact), 0, 1)
    return cv2.sepFilter2D(filled, -1, _LABEL_SPREAD, _LABEL_SPREAD, borderType=cv2.BORDER_REPLICATE)


def region_outlines(score: np.ndarray, surface: DotSurface, level: float = 0.5, refine: int = 2, ceiling: float = 1.0) -> list[Outline]:
    """Regions where score (rows, columns) is above level, with their outlines on the surface, largest first.

    NaN marks a dot that was not seen: it is continued from its neighbours. score is cut at 0 and at ceiling, since half of the
    way from free to contact is the border however hard an edge presses. Each pitch is divided by refine. Regions that touch
    the pattern's border are closed half a pitch outside of the last dots. Raises BadArgument for shapes that do not fit.
    """
    if score.shape != surface.shape or refine < 1 or not 0 < level < ceiling:
        raise BadArgument(f'region_outlines: need score {surface.shape}, refine >= 1 and 0 < level < ceiling, '
                          f'got {score.shape}, {refine}, {level}, {ceiling}')
    if not (score > level).any():
        return []
    field, row, column = _cropped(np.clip(fill_unseen(score), 0, ceiling), level)
    loops = [loop / refine + (row, column) for loop in contour(_refined(field, refine), level)]
    loops = [loop for loop in loops if len(loop) >= 3]
    return _grouped(loops, surface.points(np.concatenate(loops))) if loops else []


def _cropped(field: np.ndarray, level: float) -> tuple[np.ndarray, int, int]:
    """field around its part above level with a border of 0 three nodes off, and its first row and column; off the grid nothing touches."""
    above = field > level
    rows, columns = np.flatnonzero(above.any(1)), np.flatnonzero(above.any(0))
    row, column = int(rows[0]) - 3, int(columns[0]) - 3
    part = np.zeros((int(rows[-1]) + 4 - row, int(columns[-1]) + 4 - column))
    top, left = max(row + 1, 0), max(column + 1, 0)
    known = field[top:row + part.shape[0] - 1, left:column + part.shape[1] - 1]
    part[top - row:top - row + known.shape[0], left - column:left - column + known.shape[1]] = known
    return part, row, column


def _refined(field: np.ndarray, refine: int) -> np.ndarray:
    """field between its nodes, refine steps a node, by cubic convolution (Keys 1981), along rows and columns."""
    return _between(field.shape[0], refine) @ field @ _between(field.shape[1], refine).T


@lru_cache(maxsize=64)
def _between(nodes: int, refine: int) -> np.ndarray:
    place = np.arange((nodes - 1) * refine + 1) / refine
    start = np.minimum(place.astype(int), nodes - 2)
    matrix = np.zeros((len(place), nodes))
    for step, weight in zip(range(-1, 3), cubic_weights(place - start)):
        np.add.at(matrix, (np.arange(len(place)), np.clip(start + step, 0, nodes - 1)), weight)
    return matrix


def contour(field: np.ndarray, level: float) -> list[np.ndarray]:
    """Closed loops (M, 2) of (row, column) along which field (rows, columns) crosses level; its border must be below level.

    Linear between nodes; around what is above, loops turn from +column to +row, around holes the other way (marching squares,
    diagonal cells settled by their mean).
    """
    above = (field > level).view(np.uint8)
    code = above[:-1, :-1] + 2 * above[:-1, 1:] + 4 * above[1:, 1:] + 8 * above[1:, :-1]
    row, column = np.nonzero((code > 0) & (code < 15))
    code = code[row, column]
    saddle = (code == 5) | (code == 10)
    if saddle.any():
        row, column, code = _settled(field, level, row, column, code, saddle)
    node = row * field.shape[1] + column
    edges = np.stack([2 * node, 2 * node + 3, 2 * (node + field.shape[1]), 2 * node + 1])  # top, right, bottom, left
    each = np.arange(len(node))
    follows = dict(zip(edges[_FROM[code], each].tolist(), edges[_TO[code], each].tolist()))
    return [_crossings(np.array(loop), field, level) for loop in _cycles(follows)]


def _settled(field, level, row, column, code, saddle) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """row, column, code of all cells with each of the diagonal ones as the two segments that its mean asks for."""
    more = []
    for k in np.flatnonzero(saddle):
        middle = field[row[k]:row[k] + 2, column[k]:column[k] + 2].mean() > level
        more += [(row[k], column[k], part) for part in _SADDLES[int(code[k])][int(middle)]]
    return tuple(np.concatenate([old[~saddle], new]) for old, new in zip((row, column, code), np.array(more).T))


def _cycles(follows: dict[int, int]) -> list[list[int]]:
    """Loops of edges: edge 2 n leaves node n along its row, edge 2 n + 1 along its column."""
    loops = []
    while follows:
        first, here = follows.popitem()
        loop = [first]
        while here != first:
            loop.append(here)
            here = follows.pop(here)
        loops.append(loop)
    return loops


def _crossings(edges: np.ndarray, field: np.ndarray, level: float) -> np.ndarray:
    """(M, 2) row and column where field crosses level on each edge."""
    node, downward = np.divmod(edges, 2)
    row, column = np.divmod(node, field.shape[1])
    here, there = field[row, column], field[row + downward, column + 1 - downward]
    share = (level - here) / (there - here)
    return np.stack([row + share * downward, column + share * (1 - downward)], axis=1)


def signed_area(loop: np.ndarray) -> float:
    """Area within loop (M, 2), positive where it turns from the first axis to the second."""
    x, y = loop[:, 0] - loop[0, 0], loop[:, 1] - loop[0, 1]
    return 0.5 * float(x[:-1] @ y[1:] - x[1:] @ y[:-1])


def _grouped(loops: list[np.ndarray], points: np.ndarray) -> list[Outline]:
    """Outlines with the holes that lie in them, largest first."""
    ends = np.cumsum([len(loop) for loop in loops])
    places = [points[end - len(loop):end] for loop, end in zip(loops, ends)]
    area = np.array([-signed_area(loop) for loop in loops])  # (row, column) turns the other way than (x, y)
    outer = [k for k in np.argsort(-area) if area[k] > 0]
    holes: dict[int, list[int]] = {k: [] for k in outer}
    for hole in np.flatnonzero(area < 0):
        around = [k for k in outer if area[k] > -area[hole] and _encloses(loops[k], loops[hole][0])]
        if around:
            holes[around[-1]].append(hole)
    return [Outline(places[k], [places[h] for h in holes[k]], loops[k], [loops[h] for h in holes[k]]) for k in outer]


def _encloses(loop: np.ndarray, point: np.ndarray) -> bool:
    return cv2.pointPolygonTest(loop.astype(np.float32).reshape(-1, 1, 2), (float(point[0]), float(point[1])), False) >= 0
