# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers taken over from the last frame where dots have hardly moved, checked on the whole grid; faster than numbering anew.

A move by whole pitches looks like no move at all to the dots in the middle, but not at the edge: there dots of one outer row find none, and
on the other side dots are left over. A part that moved by a whole pitch has a seam around it, where dots are half way and find none.
"""
from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

NEAR = 0.25  # pitches: further away, a dot is not taken for the same one
BEND = 0.3  # pitches by which neighbours may differ in their move
LOST_SHARE = 0.03  # of the dots seen last may have gone, and as many (and FEW) may be left over: false or come back
FEW = 3
OUTER_SHARE = 0.6  # of an outer row's dots must be found again


def follow(uv: np.ndarray, before_uv: np.ndarray, before_id: np.ndarray, shape: tuple, pitch: float) -> np.ndarray | None:
    """Numbers (N,) int64 (-1: none) of dots at uv (N, 2) px, taken over from the last frame's; None unless that is certain."""
    tree = cKDTree(uv, leafsize=16, balanced_tree=False, compact_nodes=False)
    distance, nearest = tree.query(before_uv, distance_upper_bound=NEAR * pitch)
    found = np.flatnonzero(np.isfinite(distance))
    allowed = LOST_SHARE * len(before_uv) + FEW
    if len(before_uv) - len(found) > allowed or len(uv) - len(found) > allowed:
        return None
    number, dot = before_id[found], nearest[found]
    id = np.full(len(uv), -1)
    id[dot] = number
    if np.count_nonzero(id >= 0) < len(found):  # two dots of the last frame went to the same one
        return None
    move = np.full((shape[0] * shape[1], 2), np.nan)
    move[number] = uv[dot] - before_uv[found]
    move = move.reshape(*shape, 2)
    if not edges_found(np.isfinite(move[:, :, 0])) or torn(move, BEND * pitch):
        return None
    _fill(id, uv, shape, pitch)
    return id


def edges_found(found: np.ndarray) -> bool:
    """Whether of each outer row and column of a grid, found (rows, columns) bool, most dots were found again."""
    return min(np.count_nonzero(side) / len(side) for side in (found[0], found[-1], found[:, 0], found[:, -1])) >= OUTER_SHARE


def torn(move: np.ndarray, limit: float) -> bool:
    """Whether neighbours anywhere on the grid, moves (rows, columns, 2), moved differently by more than limit."""
    return bool((np.abs(move[1:] - move[:-1]) > limit).any() or (np.abs(move[:, 1:] - move[:, :-1]) > limit).any())


def _fill(id: np.ndarray, uv: np.ndarray, shape: tuple, pitch: float) -> None:
    """Numbers, in place, for dots left over that lie where the grid misses one."""
    loose, known = np.flatnonzero(id < 0), np.flatnonzero(id >= 0)
    if not len(loose) or len(known) == shape[0] * shape[1]:
        return
    places = np.full((shape[0] + 4, shape[1] + 4, 2), np.nan)  # a margin of two, so that neighbours two away exist
    row, column = np.divmod(id[known], shape[1])
    places[row + 2, column + 2] = uv[known]
    missing = np.setdiff1d(np.arange(shape[0] * shape[1]), id[known])
    row, column = np.divmod(missing, shape[1])
    row, column = row + 2, column + 2
    guess = np.stack([2 * places[row + a, column + b] - places[row + 2 * a, column + 2 * b] for a, b in ((0, 1), (0, -1), (1, 0), (-1, 0))])
    off = np.linalg.norm(guess[:, :, None] - uv[loose], axis=3)  # ways, missing places, dots
    off = np.where(np.isfinite(off), off, -1).max(axis=0)
    off[off < 0] = np.inf
    fits = np.argwhere((off < NEAR * pitch) & (off == off.min(axis=0)) & (off == off.min(axis=1, keepdims=True)))
    id[loose[fits[:, 1]]] = missing[fits[:, 0]]
