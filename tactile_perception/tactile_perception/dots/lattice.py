# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Finds which dots are neighbours on a printed grid, and from that relative rows and columns, from one image alone.

A field of directions over near pairs of dots says which way a row runs at each place; a dot's right neighbour is the best one that has
this dot as its own best left neighbour (mutual), at about the step of the neighbourhood; walk.py then goes along whole rows and columns.
Plane vectors are complex numbers u + iv here: turning one is a product.
"""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import cKDTree

from tactile_perception.dots.walk import Links, walk

REACH = 1.9  # pairs up to so many median nearest distances: holds a pitch of 1 next to one compressed to 0.6, and stretched rows
TOLERANCES = (0.3, 0.21)  # of the local step: a link that differs more joins no true neighbours; the second if the first contradicts itself
SLOPE = 4.0  # a step across counts as much as so many squared along, when neighbours along a row are ranked
COHERENCE = 0.15  # length of the mean direction vector under which dots do not lie on a grid at all
CELL = 2.0  # pitches: side of the cells over which steps are averaged, three by three at a time


@dataclass
class Lattice:
    """Relative numbers. rc: (N, 2) int64 row and column, valid where member (N,) bool; angle: of the rows against u, rad; pitch: px."""

    rc: np.ndarray
    member: np.ndarray
    angle: float
    pitch: float


@dataclass
class _Pairs:
    """Near pairs, first to second: i, j (M,) and the difference d (M,) as a complex number, px."""

    i: np.ndarray
    j: np.ndarray
    d: np.ndarray

    def take(self, index: np.ndarray) -> '_Pairs':
        return _Pairs(self.i[index], self.j[index], self.d[index])


def find_lattice(uv: np.ndarray, angle_hint: float = 0.0) -> Lattice | None:
    """Rows and columns of dots at uv (N, 2) px relative to each other, or None where they form no grid.

    angle_hint: rad, direction in which rows run; the answer is the one of the four possible within 45 degrees of it.
    """
    if len(uv) < 4:
        return None
    z = uv[:, 0] + 1j * uv[:, 1]
    pairs, pitch = _near_pairs(uv, z)
    if not len(pairs.i) or pitch * len(uv) <= np.ptp(uv, axis=0).max():  # a grid of so many dots cannot be wider
        return None
    cells = _Cells(z, CELL * pitch)
    field = _direction_field(pairs, cells, pitch, angle_hint)
    if field is None:
        return None
    angle, turn = field
    axes = _split(pairs, turn)
    chosen = [_mutual(p, p.d.real**2 + SLOPE * p.d.imag**2, len(uv)) for p in axes]
    if min(len(p.i) for p in chosen) < 2:
        return None
    steps = [cells.mean(p.i, p.d) for p in chosen]
    for tolerance in TOLERANCES:
        place, contradictions = walk(Links(len(uv), *(_fitting(*pair, tolerance, len(uv)) for pair in zip(axes, steps))))
        if not contradictions:
            break
    else:
        return None
    member = np.isfinite(place.real)
    rc = np.where(member, [place.imag, place.real], 0).T.astype(np.int64)
    return Lattice(rc, member, angle, pitch)


def _near_pairs(uv: np.ndarray, z: np.ndarray) -> tuple[_Pairs, float]:
    tree = cKDTree(uv, leafsize=16, balanced_tree=False, compact_nodes=False)
    sample = uv[:: max(1, len(uv) // 40)]
    nearest = float(np.median(tree.query(sample, 2)[0][:, 1]))
    i, j = tree.query_pairs(REACH * nearest, output_type='ndarray').T
    return _Pairs(i, j, z[j] - z[i]), nearest


def _direction_field(pairs: _Pairs, cells: '_Cells', pitch: float, hint: float) -> tuple[float, np.ndarray] | None:
    """Angle of the whole grid (within 45 degrees of hint) and, for each pair, the unit complex number that turns it upright."""
    near = pairs.take(np.flatnonzero(np.abs(pairs.d) < 1.3 * pitch))
    square = near.d.real**2 + near.d.imag**2
    weight = np.exp(-square / pitch**2)
    fourfold = (near.d * near.d / np.maximum(square, 1e-12)) ** 2 * weight  # four-fold symmetric: rows and columns add up
    total = fourfold.sum()
    if np.abs(total) < COHERENCE * weight.sum():
        return None
    angle = hint + np.angle(total * np.exp(-4j * hint)) / 4
    around = cells.mean(near.i, fourfold * np.exp(-4j * angle))
    return float(angle), np.exp(-1j * (angle + np.angle(around) / 4))[pairs.i]


def _split(pairs: _Pairs, turn: np.ndarray) -> tuple[_Pairs, _Pairs]:
    """Pairs along rows, left dot first, and along columns, upper dot first; differences upright, those of columns turned by -90 degrees."""
    upright = pairs.d * turn
    along_row = np.abs(upright.real) > np.abs(upright.imag)
    row, column = np.flatnonzero(along_row), np.flatnonzero(~along_row)
    return _ordered(pairs.i[row], pairs.j[row], upright[row]), _ordered(pairs.i[column], pairs.j[column], upright[column] * -1j)


def _ordered(i: np.ndarray, j: np.ndarray, d: np.ndarray) -> _Pairs:
    forward = d.real > 0
    return _Pairs(np.where(forward, i, j), np.where(forward, j, i), np.where(forward, d, -d))


def _mutual(pairs: _Pairs, cost: np.ndarray, count: int) -> _Pairs:
    """The pairs that are the cheapest at both ends."""
    order = np.argsort(-cost)
    ahead = np.full(count, -1)
    behind = np.full(count, -1)
    ahead[pairs.i[order]] = order  # written in falling cost: the cheapest stays
    behind[pairs.j[order]] = order
    index = ahead[ahead >= 0]
    return pairs.take(index[behind[pairs.j[index]] == index])


class _Cells:
    """Means over cells of the image, three by three at a time, so that a single wrong value hardly counts."""

    def __init__(self, z: np.ndarray, side: float):
        """z: (N,) complex places of the dots, side: of a cell, px."""
        column = ((z.real - z.real.min()) / side).astype(np.int64)
        row = ((z.imag - z.imag.min()) / side).astype(np.int64)
        self._shape = (int(row.max()) + 1, int(column.max()) + 1)
        self._at = row * self._shape[1] + column

    def mean(self, dot: np.ndarray, value: np.ndarray) -> np.ndarray:
        """(N,) mean around each dot of complex values (M,) that belong to dots dot (M,); where there are none, the mean of all."""
        cell, size = self._at[dot], self._shape[0] * self._shape[1]
        layers = np.stack([np.bincount(cell, w, size) for w in (None, value.real, value.imag)], axis=1)
        image = layers.reshape(*self._shape, 3)
        sums = cv2.boxFilter(image, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT).reshape(-1, 3)
        sums += 1e-3 * layers.sum(axis=0)
        return ((sums[:, 1] + 1j * sums[:, 2]) / sums[:, 0])[self._at]


def _fitting(pairs: _Pairs, step: np.ndarray, tolerance: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """First and second dots of the mutually best pairs that differ from the local step by no more than tolerance of it."""
    expected = step[pairs.i]
    off = np.abs(pairs.d - expected)
    fits = np.flatnonzero(off < tolerance * np.abs(expected))
    best = _mutual(pairs.take(fits), off[fits], count)
    return best.i, best.j
