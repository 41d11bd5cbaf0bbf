# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers as the touchpad paper gives them (section 3.5, its five steps, eqs 17 to 19), to compare with."""
from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

SEARCH = 0.5  # pitches around a predicted place in which the dot must lie; the paper only says near


def number_by_paper(uv: np.ndarray, shape: tuple[int, int], image_size: tuple[int, int]) -> tuple[np.ndarray, str]:
    """(id (N,) int64, -1 where none; reason: empty, or why none) of dots at uv (N, 2) px on a grid of shape (rows, columns).

    Steps 1 and 2: the walks along the middle row and column start at the dots nearest to two fixed points, Q_x left of and Q_y above the
    image's centre, where the ends of the middle row and column lie at rest; here half the grid's size away from it.
    """
    if len(uv) < 4:
        return np.full(len(uv), -1), f'only {len(uv)} dots found'
    tree = cKDTree(uv)
    pitch = float(np.median(tree.query(uv, 2)[0][:, 1]))
    centre = (np.asarray(image_size) - 1) / 2
    row = _walk(tree, centre - [pitch * (shape[1] - 1) / 2, 0], np.array([pitch, 0]), shape[1])
    column = _walk(tree, centre - [0, pitch * (shape[0] - 1) / 2], np.array([0, pitch]), shape[0])
    crossing = [dot for dot in row if dot in column]  # step 4: D_c lies on both
    if len(crossing) != 1:
        return np.full(len(uv), -1), f'the walks along the middle row and column meet in {len(crossing)} dots, not in one'
    return _spread(tree, crossing[0], shape, pitch), ''


def _walk(tree: cKDTree, start: np.ndarray, step: np.ndarray, count: int) -> list[int]:
    """Step 3, eqs 17 and 18: dots one after the other, each where the last two predict it; stops where there is none."""
    dots = [int(tree.query(start)[1])]
    reach = SEARCH * np.linalg.norm(step)
    while len(dots) < count:
        distance, dot = tree.query(tree.data[dots[-1]] + step, distance_upper_bound=reach)
        if not np.isfinite(distance):
            break
        step = tree.data[dot] - tree.data[dots[-1]]
        dots.append(int(dot))
    return dots


def _spread(tree: cKDTree, middle: int, shape: tuple[int, int], pitch: float) -> np.ndarray:
    """Step 5, eq 19: from the middle dot outwards, ring by ring, each dot where two or three numbered ones predict it."""
    start = (shape[0] // 2, shape[1] // 2)
    places = {start: tree.data[middle]}
    id = np.full(len(tree.data), -1)
    id[middle] = start[0] * shape[1] + start[1]
    front = [start]
    while front:
        following = []
        for row, column in front:
            for r, c in ((row, column + 1), (row, column - 1), (row + 1, column), (row - 1, column)):
                if (r, c) in places or not (0 <= r < shape[0] and 0 <= c < shape[1]):
                    continue
                distance, dot = tree.query(_predicted(places, r, c, row, column, pitch), distance_upper_bound=SEARCH * pitch)
                if np.isfinite(distance) and id[dot] < 0:
                    places[r, c], id[dot] = tree.data[dot], r * shape[1] + c
                    following.append((r, c))
        front = following
    return id


def _predicted(places: dict, r: int, c: int, row: int, column: int, pitch: float) -> np.ndarray:
    """P'_ij by the first line of eq 19 whose dots are numbered; next to the first dot, the constant vector of step 3."""
    for a, b in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        if (r + a, c + b) in places and (r + 2 * a, c + 2 * b) in places:
            return 2 * places[r + a, c + b] - places[r + 2 * a, c + 2 * b]
    for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        if {(r + a, c + b), (r + a, c), (r, c + b)} <= places.keys():
            return places[r + a, c] + places[r, c + b] - places[r + a, c + b]
    return places[row, column] + pitch * np.array([c - column, r - row])
