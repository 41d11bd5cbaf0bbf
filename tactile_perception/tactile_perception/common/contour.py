# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Outlines of contact regions: level contour of the dots' contact score on the current surface."""
from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from .dot_grid import fill_unseen
from .dot_surface import DotSurface, along_lines, refined
from ..errors import BadArgument

REFINE = 2  # steps per pitch of an outline. Chosen
_TOP, _RIGHT, _BOTTOM, _LEFT = range(4)
# Segment of a cell by which corners are inside (1 top left, 2 top right, 4 bottom left, 8 bottom right): edge it comes from, edge it goes
# to, so that outlines turn from +column to +row. Cells with two diagonal corners (9, 6) have two: those of the pair of codes given,
# first where the middle is outside, then where it is inside.
_FROM = np.array([0, _TOP, _RIGHT, _RIGHT, _LEFT, _TOP, 0, _RIGHT, _BOTTOM, 0, _BOTTOM, _BOTTOM, _LEFT, _TOP, _LEFT, 0])
_TO = np.array([0, _LEFT, _TOP, _LEFT, _BOTTOM, _BOTTOM, 0, _BOTTOM, _RIGHT, 0, _TOP, _LEFT, _RIGHT, _RIGHT, _TOP, 0])
_SADDLES = {9: ((1, 8), (11, 13)), 6: ((2, 4), (7, 14))}
_SADDLE = np.isin(np.arange(16), (9, 6))
_CROSSED = (np.arange(16) > 0) & (np.arange(16) < 15)
# Gaussian of half a pitch, which smooths the staircase of labels along a slanted edge.
_LABEL_SPREAD = np.float32([0.107, 0.786, 0.107])


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
    """Score (rows, columns), level 0.5, from labels: contact (rows, columns) of 0 and 1, NaN for unseen dots."""
    filled = np.clip(fill_unseen(contact), 0, 1)
    return cv2.sepFilter2D(filled, -1, _LABEL_SPREAD, _LABEL_SPREAD, borderType=cv2.BORDER_REPLICATE)


def region_outlines(score: np.ndarray, surface: DotSurface, level: float = 0.5, refine: int = REFINE,
                    ceiling: float = 1.0) -> list[Outline]:
    """Regions where score (rows, columns) is above level, with their outlines on the surface, largest first.

    Unseen dots (NaN) are filled from their neighbours. score is clipped to 0 and ceiling, so that the border is independent of the pressure
    of an edge. Outlines have refine steps per pitch. Regions at the pattern's border are closed half a pitch outside the last dots.
    Raises BadArgument for shapes that do not fit.
    """
    if score.shape != surface.shape or refine < 1 or not 0 < level < ceiling:
        raise BadArgument(f'region_outlines: need score {surface.shape}, refine >= 1 and 0 < level < ceiling, '
                          f'got {score.shape}, {refine}, {level}, {ceiling}')
    if not (score > level).any():
        return []
    field, row, column = _cropped(np.clip(fill_unseen(score), 0, ceiling), level)
    loops = [loop for loop in contour(refined(field[..., None], refine)[..., 0], level) if len(loop) >= 3]
    if not loops:
        return []
    places = along_lines(surface.fine(row, column, field.shape, refine), np.concatenate(loops))
    return group_loops([loop / refine + (row, column) for loop in loops], places)


def _cropped(field: np.ndarray, level: float) -> tuple[np.ndarray, int, int]:
    """field cropped to its part above level with a margin of two nodes, 0 at its border and off the grid; its first row and column."""
    above = field > level
    rows, columns = np.flatnonzero(above.any(1)), np.flatnonzero(above.any(0))
    row, column = int(rows[0]) - 2, int(columns[0]) - 2
    part = np.zeros((int(rows[-1]) + 3 - row, int(columns[-1]) + 3 - column))
    top, left = max(row + 1, 0), max(column + 1, 0)
    known = field[top:row + part.shape[0] - 1, left:column + part.shape[1] - 1]
    part[top - row:top - row + known.shape[0], left - column:left - column + known.shape[1]] = known
    return part, row, column


def contour(field: np.ndarray, level: float) -> list[np.ndarray]:
    """Closed loops (M, 2) of (row, column) along which field (rows, columns) crosses level; its border must be below level.

    Linear between nodes; around what is above, loops turn from +column to +row, around holes the other way (marching squares,
    saddle cells resolved by their mean).
    """
    width = field.shape[1]
    above = (field > level).view(np.uint8).ravel()  # the border is below, so rows may be concatenated
    pair = above[:-1] + 2 * above[1:]
    code = pair[:-width] + 4 * pair[width:]
    node = np.flatnonzero(_CROSSED[code])
    code = code[node]
    if _SADDLE[code].any():
        node, code = _saddles_split(field, level, node, code)
    start, end = (2 * node + edges[code] for edges in _edges(width))
    return [_crossings(np.array(loop), field, level) for loop in _cycles(dict(zip(start.tolist(), end.tolist())))]


@lru_cache(maxsize=64)
def _edges(width: int) -> tuple[np.ndarray, np.ndarray]:
    """For each code, ids of the edges where a cell's segment starts and ends, relative to twice its top left node; see _cycles."""
    side = np.array([0, 3, 2 * width, 1])
    return side[_FROM], side[_TO]


def _saddles_split(field, level, node, code) -> tuple[np.ndarray, np.ndarray]:
    """node and code of all cells, each saddle split into two segments by its mean."""
    more, saddle = [], _SADDLE[code]
    for k in np.flatnonzero(saddle):
        row, column = divmod(int(node[k]), field.shape[1])
        middle = field[row:row + 2, column:column + 2].mean() > level
        more += [(node[k], part) for part in _SADDLES[int(code[k])][int(middle)]]
    return tuple(np.concatenate([old[~saddle], new]) for old, new in zip((node, code), np.array(more).T))


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
    node, downward = edges >> 1, edges & 1
    flat, width = field.ravel(), field.shape[1]
    here = flat[node]
    share = (level - here) / (flat[node + 1 + downward * (width - 1)] - here)
    places = np.empty((len(edges), 2))
    places[:, 0], places[:, 1] = np.divmod(node, width)
    down = share * downward
    places[:, 0] += down
    places[:, 1] += share - down
    return places


def signed_area(loop: np.ndarray) -> float:
    """Area within loop (M, 2), positive where it turns from the first axis to the second."""
    x, y = loop[:, 0] - loop[0, 0], loop[:, 1] - loop[0, 1]
    return 0.5 * float(x[:-1] @ y[1:] - x[1:] @ y[:-1])


def group_loops(loops: list[np.ndarray], points: np.ndarray) -> list[Outline]:
    """Outlines with the holes that lie in them, largest first."""
    if len(loops) == 1:
        return [Outline(points, [], loops[0], [])]
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
