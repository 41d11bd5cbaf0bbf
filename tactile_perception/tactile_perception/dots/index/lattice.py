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

from tactile_perception.dots.detect.neighbours import near_pairs
from tactile_perception.dots.index.extrapolate import grow
from tactile_perception.dots.index.propagate import Links, walk

REACH = 1.9  # pairs up to so many median nearest distances: holds a pitch of 1 next to one compressed to 0.6, and stretched rows
TOLERANCES = (0.3, 0.21)  # of the local step: a link that differs more joins no true neighbours; the second if the first contradicts itself
SLOPE = 4.0  # a step across counts as much as so many squared along, when neighbours along a row are ranked
LOOSE = 0.05  # of the dots without a number: more are not only false ones
COHERENCE = 0.15  # length of the mean direction vector under which dots do not lie on a grid at all
_SAMPLE = 40  # dots whose nearest neighbours tell the pitch
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
    """Near pairs, first to second: i, j (M,) and the difference d (M,) as a complex number, px.

    Where pairs along rows and along columns are kept together, a dot's number in the latter is higher by the count of dots.
    """

    i: np.ndarray
    j: np.ndarray
    d: np.ndarray

    def take(self, index: np.ndarray) -> '_Pairs':
        return _Pairs(self.i[index], self.j[index], self.d[index])


def find_lattice(uv: np.ndarray, angle_hint: float = 0.0) -> Lattice | None:
    """Rows and columns of dots at uv (N, 2) px relative to each other, or None where they form no grid.

    angle_hint: rad, direction in which rows run; the answer is the one of the four possible within 45 degrees of it.
    """
    count = len(uv)
    if count < 4:
        return None
    u, v = np.ascontiguousarray(uv.T)
    pairs, pitch = _near_pairs(u, v)
    if not len(pairs.i) or pitch * count <= max(np.ptp(u), np.ptp(v)):  # a grid of so many dots cannot be wider
        return None
    cells = _Cells(u, v, CELL * pitch)
    field = _direction_field(pairs, cells, pitch, angle_hint)
    if field is None:
        return None
    angle, turn = field
    axes = _upright(pairs, turn, count)
    chosen = _mutual(axes, axes.d.real**2 + SLOPE * axes.d.imag**2, 2 * count)
    rows = np.count_nonzero(chosen.i < count)
    if min(rows, len(chosen.i) - rows) < 2:
        return None
    step = cells.mean(chosen.i, chosen.d, 2)
    for tolerance in TOLERANCES:
        rc, member, contradictions = walk(_fitting(axes, step, tolerance, count))
        if not contradictions:
            if np.count_nonzero(member) < (1 - LOOSE) * count:
                rc, member = grow(uv, rc, member, pitch)
            return Lattice(rc, member, angle, pitch)
    return None


def _near_pairs(u: np.ndarray, v: np.ndarray) -> tuple[_Pairs, float]:
    """Pairs of dots within REACH, and the median nearest distance, px, of some of them."""
    across, down = u.astype(np.float32), v.astype(np.float32)
    some = np.arange(0, len(u), max(1, len(u) // _SAMPLE))
    square = (across[some, None] - across) ** 2
    square += (down[some, None] - down) ** 2
    square[np.arange(len(some)), some] = np.inf
    nearest = float(np.sqrt(np.sort(square.min(axis=1))[len(some) // 2]))
    i, j = near_pairs(u, v, REACH * nearest)
    across, down = u.take(j) - u.take(i), v.take(j) - v.take(i)
    near = np.flatnonzero(across * across + down * down < (REACH * nearest) ** 2)
    return _Pairs(i.take(near), j.take(near), across.take(near) + 1j * down.take(near)), nearest


def _direction_field(pairs: _Pairs, cells: '_Cells', pitch: float, hint: float) -> tuple[float, np.ndarray] | None:
    """Angle of the whole grid (within 45 degrees of hint) and, for each pair, the unit complex number that turns it upright."""
    square = pairs.d.real**2 + pairs.d.imag**2
    near = np.flatnonzero(square < (1.3 * pitch) ** 2)
    i, d, square = pairs.i[near], pairs.d[near], square[near]
    weight = np.exp(square * (-1 / pitch**2))
    double = d * d
    fourfold = double * double * (weight / np.maximum(square * square, 1e-24))  # four-fold symmetric: rows and columns add up
    total = fourfold.sum()
    if np.abs(total) < COHERENCE * weight.sum():
        return None
    angle = hint + np.angle(total * np.exp(-4j * hint)) / 4
    around = cells.mean(i, fourfold * np.exp(-4j * angle))
    return float(angle), np.exp(-1j * (angle + np.angle(around) / 4))[pairs.i]


def _upright(pairs: _Pairs, turn: np.ndarray, count: int) -> _Pairs:
    """Pairs along rows, left dot first, and along columns, upper dot first; differences upright, those of columns turned by -90 degrees."""
    d = pairs.d * turn
    column = np.abs(d.real) <= np.abs(d.imag)
    d = np.where(column, d * -1j, d)
    forward = d.real > 0
    i, j = np.where(forward, pairs.i, pairs.j), np.where(forward, pairs.j, pairs.i)
    offset = column * count
    return _Pairs(i + offset, j + offset, np.where(forward, d, -d))


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

    def __init__(self, u: np.ndarray, v: np.ndarray, side: float):
        """u, v: (N,) places of the dots, side: of a cell, px."""
        column, row = ((u - u.min()) / side).astype(np.int64), ((v - v.min()) / side).astype(np.int64)
        self._columns = int(column.max()) + 1
        self._size = (int(row.max()) + 2) * self._columns  # an empty row below keeps one layer from the next
        self._at = row * self._columns + column

    def mean(self, dot: np.ndarray, value: np.ndarray, layers: int = 1) -> np.ndarray:
        """(layers * N,) mean around each dot of complex values (M,) that belong to dots dot (M,), numbered on from layer to layer; where
        there are none, the mean of the layer."""
        at = self._at if layers == 1 else (self._at + np.arange(layers)[:, None] * self._size).ravel()
        cell = at[dot]
        sums = np.stack([np.bincount(cell, w, layers * self._size) for w in (None, value.real, value.imag)])
        near = cv2.boxFilter(sums.reshape(-1, self._columns), -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
        near = near.reshape(3, layers, -1) + 1e-3 * sums.reshape(3, layers, -1).sum(axis=2, keepdims=True)
        n, real, imag = near.reshape(3, -1)
        return ((real + 1j * imag) / np.maximum(n, 1e-9))[at]


def _fitting(pairs: _Pairs, step: np.ndarray, tolerance: float, count: int) -> Links:
    """Links of the mutually best pairs that differ from the local step by no more than tolerance of it."""
    expected = step[pairs.i]
    off = np.abs(pairs.d - expected)
    fits = np.flatnonzero(off < tolerance * np.abs(expected))
    best = _mutual(pairs.take(fits), off[fits], 2 * count)
    column = best.i >= count
    return Links(count, (best.i[~column], best.j[~column]), (best.i[column] - count, best.j[column] - count))
