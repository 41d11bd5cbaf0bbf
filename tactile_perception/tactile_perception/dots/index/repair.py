# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The last steps of indexing: indices for dots that are left where exactly as many places of the grid are, and the rejection of outliers,
dots whose step to a neighbour on the grid is unlike those around it."""
from __future__ import annotations

import cv2
import numpy as np
from scipy.optimize import linear_sum_assignment

BENDS = 3.0  # times what the grid bends at most within NEAR rows and columns: more, and the dots left are false ones
NEAR = 3
MOST_SHARE = 0.2  # of the grid: with more dots left, their order is not certain


def complete_grid(id: np.ndarray, uv: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """id (N,) int64 of dots at uv (N, 2) px on a grid of shape (rows, columns), with the dots that had none (-1) numbered; or as it was."""
    count = shape[0] * shape[1]
    loose, numbered = np.flatnonzero(id < 0), np.flatnonzero(id >= 0)
    if not len(loose) or len(id) != count or len(loose) > MOST_SHARE * count:
        return id
    missing = np.setdiff1d(np.arange(count), id[numbered])
    places = np.full((count, 2), np.nan)
    places[id[numbered]] = uv[numbered]
    bends = _bends(shape)
    places[missing] = _least_bent(places, bends, missing)
    first = places[missing]
    dot = linear_sum_assignment(((first[:, None] - uv[loose])**2).sum(axis=2))[1]
    dot = _exchange(places, bends, missing, uv[loose], dot)
    places[missing] = uv[loose[dot]]
    if _turned_over(places.reshape(*shape, 2)) or _bends_more(places, bends, missing, shape[1]):
        return id
    completed = id.copy()
    completed[loose[dot]] = missing
    return completed


def _bends(shape) -> np.ndarray:
    """(T, 3) numbers of three successive places along rows and columns."""
    number = np.arange(shape[0] * shape[1]).reshape(shape)
    rows = np.stack([number[:, :-2], number[:, 1:-1], number[:, 2:]], axis=-1).reshape(-1, 3)
    columns = np.stack([number[:-2], number[1:-1], number[2:]], axis=-1).reshape(-1, 3)
    return np.vstack([rows, columns])


def _least_bent(places, bends, missing):
    """(M, 2) places of the missing that make the second differences smallest."""
    bends = bends[np.isin(bends, missing).any(axis=1)]
    unknown = np.full(len(places), -1)
    unknown[missing] = np.arange(len(missing))
    matrix, side = np.zeros((len(bends), len(missing))), np.zeros((len(bends), 2))
    for k, factor in enumerate((1.0, -2.0, 1.0)):
        at = unknown[bends[:, k]]
        free = at >= 0
        matrix[np.flatnonzero(free), at[free]] += factor
        side[~free] -= factor * places[bends[~free, k]]
    return np.linalg.lstsq(matrix, side, rcond=None)[0]


def _exchange(places, bends, missing, uv, dot):
    """The assignment dot (M,) of places uv (M, 2) to the missing, with pairs exchanged while the grid bends less."""
    bends = bends[np.isin(bends, missing).any(axis=1)]
    places, dot = places.copy(), dot.copy()

    def bending():
        """How much the grid bends with the assignment as it is, px^2."""
        places[missing] = uv[dot]
        a, b, c = places[bends.T]
        return ((a - 2 * b + c)**2).sum()

    least, better = bending(), True
    while better:
        better = False
        for i in range(len(dot)):
            for j in range(i):
                dot[[i, j]] = dot[[j, i]]
                energy = bending()
                if energy < least * (1 - 1e-9):
                    least, better = energy, True
                else:
                    dot[[i, j]] = dot[[j, i]]
    return dot


def _turned_over(grid) -> bool:
    """Whether a corner of any mesh of places (rows, columns, 2) turns the wrong way."""
    right, down = np.diff(grid, axis=1), np.diff(grid, axis=0)
    for r, d in ((right[:-1], down[:, :-1]), (right[:-1], down[:, 1:]), (right[1:], down[:, :-1]), (right[1:], down[:, 1:])):
        if (r[..., 0] * d[..., 1] - r[..., 1] * d[..., 0] <= 0).any():
            return True
    return False


def _bends_more(places, bends, missing, columns) -> bool:
    """Whether the grid bends more at the missing places than it does near them."""
    a, b, c = places[bends.T]
    size = np.hypot(*(a - 2 * b + c).T)
    new = np.isin(bends, missing).any(axis=1)
    apart = [np.abs(x[:, None] - y) for x, y in zip(np.divmod(bends[:, 1], columns), np.divmod(missing, columns))]
    near = (np.maximum(*apart) <= NEAR).any(axis=1) & ~new
    return bool(size[new].max(initial=0) > BENDS * size[near].max(initial=0))


AROUND = 5  # rows and columns over which steps are averaged
JUMP = 0.6  # of the step around: a step that differs more joins two dots of which one has a wrong number
BESIDE = 0.25  # of the step around: a dot all of whose steps differ more is not the one that belongs there
_SQUARE = np.ones((3, 3), np.uint8)


def leave_out_jumps(id: np.ndarray, uv: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """id (N,) int64 of dots at uv (N, 2) px on a grid of shape (rows, columns), -1 for dots at either end of a jump and next to one, and
    for dots beside their place."""
    numbered = np.flatnonzero(id >= 0)
    places = np.full(shape[0] * shape[1], np.nan + 0j)
    places[id[numbered]] = uv[numbered, 0] + 1j * uv[numbered, 1]
    places = places.reshape(shape)
    bad, placed = np.zeros(shape, bool), np.zeros(shape, bool)
    for z, ends, held in ((places, bad, placed), (places.T, bad.T, placed.T)):
        off = _off(z[1:] - z[:-1])
        jump, even = off > JUMP, off < BESIDE
        ends[:-1] |= jump
        ends[1:] |= jump
        held[:-1] |= even
        held[1:] |= even
    if bad.any():  # what hangs on the wrong number too
        placed &= cv2.dilate(bad.astype(np.uint8), _SQUARE) == 0
    cleaned = id.copy()
    cleaned[numbered[~placed.ravel()[id[numbered]]]] = -1
    return cleaned


def _off(step: np.ndarray) -> np.ndarray:
    """(...) by how much complex steps (...), NaN where not known, differ from the mean around them, as a share of it."""
    known = np.isfinite(step.real)
    layers = np.stack([np.where(known, step.real, 0), np.where(known, step.imag, 0), known], axis=2)
    sums = cv2.boxFilter(layers, -1, (AROUND, AROUND), normalize=False, borderType=cv2.BORDER_CONSTANT)
    mean = (sums[:, :, 0] + 1j * sums[:, :, 1]) / np.maximum(sums[:, :, 2], 1)
    return np.abs(step - mean) / np.maximum(np.abs(mean), 1e-9)
