# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact point from the depths of a grid of markers: Gaussian fits through the deepest marker and two neighbours on each side
(paper areal_sensor_contact_position, eqs 8 to 13), with fall-backs where such a fit has no peak.

Methods in the order tried, by the reason of the estimate: '' the paper's two fits; 'weighted' the same with log depths weighted by depth,
from three markers on; 'two_dimensional' one Gaussian over five by five markers; 'centroid' weighted by depth.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

REACH = 2      # neighbours on each side (paper, eq 13)
LEAST = 0.02   # of the greatest depth: shallower markers are mostly noise, which the log amplifies. Chosen
ABROAD = 1.0   # pitches, largest distance of a valid peak from the deepest marker. Chosen: beyond it another marker would be deepest
FLAT = 1e-3    # log depth: a fit that falls by less over the neighbours has no peak. Chosen
TALL = 1.5     # largest height of a valid peak over the deepest marker. Chosen


@dataclass(frozen=True)
class GridPoint:
    """place: (2,) m; depth: m; reason: '' or the name of the fall-back; at_edge: the deepest marker is on the border of the grid."""

    place: np.ndarray
    depth: float
    reason: str
    at_edge: bool


def gaussian(x: np.ndarray, y: np.ndarray, weight: np.ndarray | None = None) -> tuple[float, float]:
    """Centre and height of the Gaussian through y > 0 at x (eqs 9 to 13); NaN where the fit has no peak or too few points."""
    if len(x) < 3:
        return np.nan, np.nan
    middle, weight = x.mean(), np.ones(len(x)) if weight is None else weight
    powers = (x[:, None] - middle) ** np.arange(3)
    scale = np.abs(x - middle).max() ** np.arange(3)
    d = np.linalg.lstsq(powers / scale * weight[:, None], np.log(y / y.max()) * weight, rcond=None)[0] / scale
    if not d[2] * scale[2] < -FLAT:
        return np.nan, np.nan
    centre = -d[1] / (2 * d[2])
    return float(centre + middle), float(y.max() * np.exp(min(d[0] - d[1] ** 2 / (4 * d[2]), 50.0)))


def grid_point(depth: np.ndarray, places: np.ndarray, pitch: tuple[float, float]) -> GridPoint | None:
    """The contact point of depths (rows, columns) m of markers at places (rows, columns, 2) m, both NaN where unknown.

    None where no marker has a positive depth.
    """
    depth = np.where(np.isfinite(places).all(-1) & np.isfinite(depth), depth, np.nan)
    if not np.nanmax(depth, initial=0.0) > 0:
        return None
    row, column = np.unravel_index(np.nanargmax(depth), depth.shape)
    at_edge = bool(row in (0, depth.shape[0] - 1) or column in (0, depth.shape[1] - 1))
    for reason, way in (('', _two_fits), ('weighted', _weighted_fits), ('two_dimensional', _one_fit)):
        place, height = way(depth, places, row, column)
        off = np.abs(place - places[row, column]) / pitch
        if (off <= ABROAD).all() and 0 < height <= TALL * depth[row, column]:
            return GridPoint(place, height, reason, at_edge)
    return GridPoint(_centroid(depth, places, row, column), float(depth[row, column]), 'centroid', at_edge)


def _lines(depth, places, row, column):
    """Along x and along y: places and depths of the markers within REACH of the deepest, fewer at the border."""
    for axis in (0, 1):
        index = (column, row)[axis] + np.arange(-REACH, REACH + 1)
        index = index[(index >= 0) & (index < depth.shape[1 - axis])]
        line = (row, index) if axis == 0 else (index, column)
        yield places[line][:, axis], depth[line]


def _two_fits(depth, places, row, column):
    """The paper's fits: five markers along each axis, all of positive depth."""
    lines = list(_lines(depth, places, row, column))
    if not all(len(y) == 2 * REACH + 1 and (y > 0).all() for _, y in lines):
        return np.full(2, np.nan), np.nan
    fits = [gaussian(x, y) for x, y in lines]
    return np.array([fit[0] for fit in fits]), float(np.mean([fit[1] for fit in fits]))


def _weighted_fits(depth, places, row, column):
    least, fits = LEAST * depth[row, column], []
    for x, y in _lines(depth, places, row, column):
        deep = y > least
        fits.append(gaussian(x[deep], y[deep], y[deep]))
    return np.array([fit[0] for fit in fits]), float(np.mean([fit[1] for fit in fits]))


def _patch(depth, places, row, column):
    rows, columns = slice(max(row - REACH, 0), row + REACH + 1), slice(max(column - REACH, 0), column + REACH + 1)
    deep, where = depth[rows, columns].ravel(), places[rows, columns].reshape(-1, 2)
    good = deep > LEAST * depth[row, column]
    return deep[good], where[good]


def _one_fit(depth, places, row, column):
    deep, where = _patch(depth, places, row, column)
    if len(deep) < 6:
        return np.full(2, np.nan), np.nan
    scale = np.ptp(where, axis=0).max()
    x, y = ((where - places[row, column]) / scale).T
    powers = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    d = np.linalg.lstsq(powers * deep[:, None], np.log(deep) * deep, rcond=None)[0]
    curve = np.array([[2 * d[3], d[4]], [d[4], 2 * d[5]]])
    if not np.linalg.eigvalsh(curve)[1] < -FLAT:
        return np.full(2, np.nan), np.nan
    peak = -np.linalg.solve(curve, d[1:3])
    height = np.exp(min(d[0] + d[1:3] @ peak / 2, 50.0))
    return places[row, column] + peak * scale, float(height)


def _centroid(depth, places, row, column):
    deep, where = _patch(depth, places, row, column)
    return deep @ where / deep.sum()
