# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Outlines and moments of regions in NumPy: what the compiled ones measure themselves against."""
import math

import cv2
import numpy as np
from tactile_perception.common.surface import Moments, Outline
from tactile_perception.common.geometry import cross

BEYOND = 2  # nodes extrapolated on each side, as a cubic needs
_TOP, _RIGHT, _BOTTOM, _LEFT = range(4)
# Segment of a cell by which corners are inside (1 top left, 2 top right, 4 bottom left, 8 bottom right): edge it comes from, edge it goes
# to, so that outlines turn from +column to +row. Cells with two diagonal corners (9, 6) have two: those of the pair of codes given,
# first where the middle is outside, then where it is inside.
_FROM = np.array([0, _TOP, _RIGHT, _RIGHT, _LEFT, _TOP, 0, _RIGHT, _BOTTOM, 0, _BOTTOM, _BOTTOM, _LEFT, _TOP, _LEFT, 0])
_TO = np.array([0, _LEFT, _TOP, _LEFT, _BOTTOM, _BOTTOM, 0, _BOTTOM, _RIGHT, 0, _TOP, _LEFT, _RIGHT, _RIGHT, _TOP, 0])
_SADDLES = {9: ((1, 8), (11, 13)), 6: ((2, 4), (7, 14))}
_SADDLE = np.isin(np.arange(16), (9, 6))
_CROSSED = (np.arange(16) > 0) & (np.arange(16) < 15)
# Channels of the integrand, per unit of area in (row, column).
_AREA, _VECTOR, _FIRST, _SECOND = 0, slice(1, 4), slice(4, 7), slice(7, 10)
# Standard deviation of an outline, and the correlation length of its errors, in pitches of the dots. Chosen.
OUTLINE_SIGMA = 0.3
OUTLINE_LENGTH = 1.0
# Standard deviations by which the two variances of a region with a direction differ (about 10 degrees uncertainty). Chosen.
_DIRECTION = 3.0
_SLOPE_STEP = 0.01  # pitches, of the finite differences
_AROUND = np.array([[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1]])
_FOUR = np.arange(4)


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


def cubic_weights(t: np.ndarray) -> np.ndarray:
    """(4, N) weights of the nodes -1, 0, 1, 2 at t (N,) in [0, 1] (Keys 1981, a = -1/2: exact for parabolas)."""
    square = t * t
    cube = square * t
    return np.array([2 * square - cube - t, 2 - 5 * square + 3 * cube, t + 4 * square - 3 * cube, cube - square]) * 0.5


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


def outlines_of(score, surface, level=0.5, refine=2, ceiling=1.0):
    """region_outlines of a score without unseen dots."""
    if not (score > level).any():
        return []
    field, row, column = _cropped(np.clip(score, 0, ceiling), level)
    loops = [loop for loop in contour(refined(field[..., None], refine)[..., 0], level) if len(loop) >= 3]
    if not loops:
        return []
    part = surface.wide[row + BEYOND:row + BEYOND + field.shape[0], column + BEYOND:column + BEYOND + field.shape[1]]
    places = along_lines(refined(part, refine), np.concatenate(loops))
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


class MomentField:
    """The integrands over the part of one frame's surface that the outlines, at least one, cover; computed once for all regions.

    refine: as of the outlines. pitch: mean distance of neighbouring dots, m.
    """

    def __init__(self, surface, outlines, refine=2):
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


def place_and_normal(surface, xy):
    """The surface's point (3,), m, at xy (2,), m, seen along z, and its unit normal (3,), out of the sensor, as it slopes over a pitch
    on each side: Newton steps from the nearest dot."""
    off = surface.xyz[..., :2] - xy
    place = np.array(divmod(int(np.argmin(np.einsum('ijk,ijk->ij', off, off))), surface.shape[1]), float)
    found = values_at(surface.wide, place + _SLOPE_STEP * _AROUND[:3])[:, :2]
    (a, c), (b, d) = (found[1:] - found[0]) / _SLOPE_STEP
    inverse = np.array([[d, -b], [-c, a]]) / (a * d - b * c)  # the Jacobian is kept for both steps
    place = place + np.clip(inverse @ (xy - found[0]), -1, 1)
    place = place + np.clip(inverse @ (xy - values_at(surface.wide, place[None])[0, :2]), -1, 1)
    point, below, right, above, left = values_at(surface.wide, place + _AROUND)
    normal = cross(right - left, below - above)
    return point, normal / np.sqrt(normal @ normal)
