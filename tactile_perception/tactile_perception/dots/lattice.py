# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Finds which dots are neighbours on a printed grid, and from that relative rows and columns, from one image alone.

A field of directions over near pairs of dots says which way a row runs at each place; a dot's right neighbour is the best one that has
this dot as its own best left neighbour (mutual), at about the local distance; whole meshes of four carry the numbers breadth-first.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components
from scipy.spatial import cKDTree

REACH = 1.9  # pairs up to so many median nearest distances: holds a pitch of 1 next to one compressed to 0.6, and stretched rows
TOLERANCE = 0.42  # of the local pitch: a link that differs more from its neighbourhood joins no true neighbours
SLOPE = 4.0  # a step across counts as much as so many squared along, when neighbours along a row are ranked
COHERENCE = 0.15  # length of the mean direction vector under which dots do not lie on a grid at all


@dataclass
class Lattice:
    """Relative numbers. rc: (N, 2) int64 row and column, zero based, valid where member (N,) bool; angle: of the rows against u, rad; pitch: px."""

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


def find_lattice(uv: np.ndarray, angle_hint: float = 0.0) -> Lattice | None:
    """Rows and columns of dots at uv (N, 2) px relative to each other, or None where they form no grid.

    angle_hint: rad, direction in which rows run; the answer is the one of the four possible within 45 degrees of it.
    """
    if len(uv) < 4:
        return None
    pairs, pitch = _near_pairs(uv)
    if not len(pairs.i):
        return None
    field = _direction_field(pairs, len(uv), pitch, angle_hint)
    if field is None:
        return None
    angle, turn = field
    horizontal, vertical = _split(pairs, turn)
    links = _links(horizontal, vertical, len(uv))
    rc, member = _walk(links, len(uv))
    return Lattice(rc, member, angle, pitch)


def _near_pairs(uv: np.ndarray) -> tuple[_Pairs, float]:
    tree = cKDTree(uv, leafsize=16, balanced_tree=False, compact_nodes=False)
    sample = uv[:: max(1, len(uv) // 60)]
    nearest = float(np.median(tree.query(sample, 2)[0][:, 1]))
    found = tree.query_pairs(REACH * nearest, output_type='ndarray')
    i, j = found[:, 0], found[:, 1]
    z = uv[:, 0] + 1j * uv[:, 1]
    return _Pairs(i, j, z[j] - z[i]), nearest


def _direction_field(pairs: _Pairs, count: int, pitch: float, hint: float) -> tuple[float, np.ndarray] | None:
    """Angle of the whole grid (within 45 degrees of hint) and, for each pair, the unit complex number that turns it upright."""
    square = np.abs(pairs.d) ** 2
    weight = np.exp(-square / pitch**2)
    fourfold = (pairs.d * pairs.d / np.maximum(square, 1e-12)) ** 2 * weight  # four-fold symmetric: rows and columns add up
    total = fourfold.sum()
    if np.abs(total) < COHERENCE * weight.sum():
        return None
    angle = hint + np.angle(total * np.exp(-4j * hint)) / 4
    own = _sum_at_both_ends(pairs, fourfold, fourfold, count)
    smooth = own + _sum_at_both_ends(pairs, own[pairs.j], own[pairs.i], count)
    local = np.angle((smooth[pairs.i] + smooth[pairs.j]) * np.exp(-4j * angle)) / 4
    return float(angle), np.exp(-1j * (angle + local))


def _sum_at_both_ends(pairs: _Pairs, at_i: np.ndarray, at_j: np.ndarray, count: int) -> np.ndarray:
    real = np.bincount(pairs.i, at_i.real, count) + np.bincount(pairs.j, at_j.real, count)
    imag = np.bincount(pairs.i, at_i.imag, count) + np.bincount(pairs.j, at_j.imag, count)
    return real + 1j * imag


def _split(pairs: _Pairs, turn: np.ndarray) -> tuple[_Pairs, _Pairs]:
    """Pairs along rows, left dot first, and along columns, upper dot first; differences in the upright frame, columns turned by -90 degrees."""
    upright = pairs.d * turn
    along_row = np.abs(upright.real) > np.abs(upright.imag)
    row = _ordered(pairs.i[along_row], pairs.j[along_row], upright[along_row])
    column = _ordered(pairs.i[~along_row], pairs.j[~along_row], upright[~along_row] * -1j)
    return row, column


def _ordered(i: np.ndarray, j: np.ndarray, d: np.ndarray) -> _Pairs:
    forward = d.real > 0
    return _Pairs(np.where(forward, i, j), np.where(forward, j, i), np.where(forward, d, -d))


def _links(row: _Pairs, column: _Pairs, count: int) -> np.ndarray:
    """(N, 4) int64 neighbours right, left, below, above, -1 where none: mutual, and like their neighbourhood."""
    first = [_mutual(p, p.d.real**2 + SLOPE * p.d.imag**2, count) for p in (row, column)]
    table = _table(first, count)
    second = []
    for axis, (pairs, chosen) in enumerate(((row, first[0]), (column, first[1]))):
        expected = _local_step(chosen, table, axis, count)
        off = np.abs(pairs.d - (expected[pairs.i] + expected[pairs.j]) / 2)
        fits = off < TOLERANCE * np.abs(expected[pairs.i])
        second.append(_mutual(_Pairs(pairs.i[fits], pairs.j[fits], pairs.d[fits]), off[fits], count))
    return _table(second, count)


def _mutual(pairs: _Pairs, cost: np.ndarray, count: int) -> _Pairs:
    """The pairs that are the cheapest at both ends."""
    order = np.argsort(-cost)
    ahead = np.full(count, -1)
    behind = np.full(count, -1)
    ahead[pairs.i[order]] = order  # written in falling cost: the cheapest stays
    behind[pairs.j[order]] = order
    index = ahead[ahead >= 0]
    keep = index[behind[pairs.j[index]] == index]
    return _Pairs(pairs.i[keep], pairs.j[keep], pairs.d[keep])


def _table(links: list[_Pairs], count: int) -> np.ndarray:
    table = np.full((count, 4), -1)
    for axis, pairs in enumerate(links):
        table[pairs.i, 2 * axis] = pairs.j
        table[pairs.j, 2 * axis + 1] = pairs.i
    return table


def _local_step(chosen: _Pairs, table: np.ndarray, axis: int, count: int) -> np.ndarray:
    """(N,) complex step to the next dot along the axis at each dot: lower median over its own and its side neighbours' links.

    The lower median, since a link over a missing dot is twice too long, and none is twice too short.
    """
    step = np.full((2, count + 1), np.nan + 0j)  # one more row than dots: neighbour -1 reads nothing
    step[0, chosen.i] = chosen.d
    step[1, chosen.j] = chosen.d
    side = table[:, 2 - 2 * axis: 4 - 2 * axis]
    near = np.concatenate([step[:, :count], step[:, side[:, 0]], step[:, side[:, 1]]])
    everywhere = np.median(chosen.d.real) + 1j * np.median(chosen.d.imag) if len(chosen.d) else np.nan
    known = np.isfinite(near.real).sum(axis=0)
    middle = np.maximum(known - 1, 0) // 2
    pick = np.arange(count)
    median = np.sort(near.real, axis=0)[middle, pick] + 1j * np.sort(near.imag, axis=0)[middle, pick]
    return np.where(known > 0, median, everywhere)


def _walk(links: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns by breadth-first steps over links that close whole meshes; other dots join where their links agree."""
    sound = np.where(_in_mesh(links), links, -1)
    rc, member = _breadth_first(sound, count)
    for _ in range(2):
        rc, member = _join(links, rc, member)
    member &= ~_contradicted(links, rc, member)
    return rc, member


def _in_mesh(links: np.ndarray) -> np.ndarray:
    """(N, 4) bool: the link is a side of a closed mesh: right then below ends where below then right does."""
    padded = np.vstack([links, np.full((1, 4), -1)])  # neighbour -1 reads the last row: -1
    right, below = padded[:, 0], padded[:, 2]
    corner = padded[right, 2]
    closed = (corner >= 0) & (corner == padded[below, 0])
    top_left = np.flatnonzero(closed)
    good = np.zeros(padded.shape, bool)
    for dot, sides in ((top_left, (0, 2)), (right[top_left], (1, 2)), (below[top_left], (0, 3)), (corner[top_left], (1, 3))):
        for side in sides:
            good[dot, side] = True
    return good[:-1]


_STEP = np.array([[0, 1], [0, -1], [1, 0], [-1, 0]])  # row, column of the neighbour right, left, below, above


def _breadth_first(links: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns (smallest is zero) in the largest connected part."""
    present = links >= 0
    ends = np.concatenate([[0], np.cumsum(present.sum(axis=1))])
    graph = csr_array((np.ones(ends[-1]), links[present], ends), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    largest = label == np.bincount(label).argmax()
    root = int(np.flatnonzero(largest)[largest.sum() // 2])
    _, parent = breadth_first_order(graph, root, directed=True)
    parent = np.where(parent < 0, root, parent)
    rc = _STEP[np.argmax(links[parent] == np.arange(count)[:, None], axis=1)]
    rc = np.where((largest & (np.arange(count) != root))[:, None], rc, 0)
    while np.any(parent != root):  # each step doubles the length of the path that is summed up
        rc = rc + rc[parent]
        parent = parent[parent]
    return rc, largest


def _join(links: np.ndarray, rc: np.ndarray, member: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers to dots whose links into the numbered part all say the same."""
    known = (links >= 0) & member[links]
    said = rc[links] - _STEP
    high = np.where(known[:, :, None], said, -(10**9)).max(axis=1)
    low = np.where(known[:, :, None], said, 10**9).min(axis=1)
    new = ~member & np.all(high == low, axis=1)
    return np.where(new[:, None], high, rc), member | new


def _contradicted(links: np.ndarray, rc: np.ndarray, member: np.ndarray) -> np.ndarray:
    """(N,) bool: dots with a link that tells another number, or with a number that another dot has too."""
    known = (links >= 0) & member[links] & member[:, None]
    wrong = (known & np.any(rc[links] - rc[:, None] != _STEP, axis=2)).any(axis=1)
    low = rc.min(axis=0)
    flat = (rc[:, 0] - low[0]) * (np.ptp(rc[:, 1]) + 1) + rc[:, 1] - low[1]
    flat = np.where(member, flat, -1)
    used = np.bincount(flat + 1)
    return wrong | (member & (used[flat + 1] > 1))
