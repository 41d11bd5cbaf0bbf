# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Indices carried over from the last frame where dots have hardly moved, checked on the whole grid; faster than indexing from scratch.

A shift by exactly one pitch is unobservable in the middle of the grid, but not at its edge: one outer row finds no dots, and on the
opposite side dots remain unmatched. A part shifted by one pitch shows at its boundary, where dots are halfway and find no match.
"""
from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

NEAR = 0.25  # pitches, farthest match between frames. Chosen
BEND = 0.3  # pitches, largest difference between the displacements of neighbours. Chosen
# Of the n dots of the last frame, LOST_SHARE * n + FEW may be lost, and as many new ones may be unmatched (false or seen again). Chosen
LOST_SHARE = 0.03
FEW = 3
OUTER_SHARE = 0.6  # smallest share of an outer row's dots that must be matched. Chosen


def follow(uv: np.ndarray, before_uv: np.ndarray, before_id: np.ndarray, shape: tuple, pitch: float) -> np.ndarray | None:
    """Indices (N,) int64, -1 for none, of dots at uv (N, 2) px, carried over from the last frame; None unless they are certain.

    before_uv: (M, 2) px and before_id: (M,), of the last frame; shape: (rows, columns); pitch: px.
    """
    tree = cKDTree(uv, leafsize=16, balanced_tree=False, compact_nodes=False)
    distance, nearest = tree.query(before_uv, distance_upper_bound=NEAR * pitch)
    found = np.flatnonzero(np.isfinite(distance))
    allowed = LOST_SHARE * len(before_uv) + FEW
    if len(before_uv) - len(found) > allowed or len(uv) - len(found) > allowed:
        return None
    number, dot = before_id[found], nearest[found]
    id = np.full(len(uv), -1)
    id[dot] = number
    if np.count_nonzero(id >= 0) < len(found):  # two dots of the last frame matched the same one
        return None
    move = np.full((shape[0] * shape[1], 2), np.nan)
    move[number] = uv[dot] - before_uv[found]
    move = move.reshape(*shape, 2)
    if not edges_found(np.isfinite(move[:, :, 0])) or torn(move, BEND * pitch):
        return None
    _fill(id, uv, shape, pitch)
    return id


def edges_found(found: np.ndarray) -> bool:
    """Whether at least OUTER_SHARE of each outer row and column of a grid was matched; found: (rows, columns) bool."""
    return min(np.count_nonzero(side) / len(side) for side in (found[0], found[-1], found[:, 0], found[:, -1])) >= OUTER_SHARE


def torn(move: np.ndarray, limit: float) -> bool:
    """Whether the displacements of any two grid neighbours differ by more than limit, px; move: (rows, columns, 2) px, NaN if unknown."""
    return bool((np.abs(move[1:] - move[:-1]) > limit).any() or (np.abs(move[:, 1:] - move[:, :-1]) > limit).any())


def _fill(id: np.ndarray, uv: np.ndarray, shape: tuple, pitch: float) -> None:
    """Index unmatched dots, in place, that lie at the predicted position of a missing dot."""
    loose, known = np.flatnonzero(id < 0), np.flatnonzero(id >= 0)
    if not len(loose) or len(known) == shape[0] * shape[1]:
        return
    places = np.full((shape[0] + 4, shape[1] + 4, 2), np.nan)  # a margin of two for the neighbours two steps away
    row, column = np.divmod(id[known], shape[1])
    places[row + 2, column + 2] = uv[known]
    missing = np.setdiff1d(np.arange(shape[0] * shape[1]), id[known])
    row, column = np.divmod(missing, shape[1])
    row, column = row + 2, column + 2
    guess = np.stack([2 * places[row + a, column + b] - places[row + 2 * a, column + 2 * b] for a, b in ((0, 1), (0, -1), (1, 0), (-1, 0))])
    off = np.linalg.norm(guess[:, :, None] - uv[loose], axis=3)  # directions, missing dots, unmatched dots
    off = np.where(np.isfinite(off), off, -1).max(axis=0)
    off[off < 0] = np.inf
    fits = np.argwhere((off < NEAR * pitch) & (off == off.min(axis=0)) & (off == off.min(axis=1, keepdims=True)))
    id[loose[fits[:, 1]]] = missing[fits[:, 0]]
