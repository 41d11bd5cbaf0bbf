# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The published indexing (touchpad_contact_region, section 3.5: five steps, eqs 17, 18 and the unnumbered one of step 5)."""
from __future__ import annotations

import numpy as np
import scipy

SEARCH = 0.5  # pitches around a predicted position. Chosen: the paper gives no value; wider ones overlap


def number_by_paper(uv: np.ndarray, shape: tuple[int, int], image_size: tuple[int, int]) -> tuple[np.ndarray, str]:
    """(id (N,) int64, -1 for none; reason: empty, or why no dot is indexed) of dots at uv (N, 2) px on a grid of shape (rows, columns).

    Steps 1 and 2: the middle row and column start at the dots nearest to two fixed points, Q_x left of and Q_y above the image's centre;
    here half the grid's size away from it.
    """
    if len(uv) < 4:
        return np.full(len(uv), -1), f'only {len(uv)} dots found'
    tree = scipy.spatial.cKDTree(uv)
    pitch = float(np.median(tree.query(uv, 2)[0][:, 1]))
    centre = (np.asarray(image_size) - 1) / 2
    row = _propagate_line(tree, centre - [pitch * (shape[1] - 1) / 2, 0], np.array([pitch, 0]), shape[1])
    column = _propagate_line(tree, centre - [0, pitch * (shape[0] - 1) / 2], np.array([0, pitch]), shape[0])
    crossing = [dot for dot in row if dot in column]  # step 4: D_c lies on both
    if len(crossing) != 1:
        return np.full(len(uv), -1), f'the middle row and column meet in {len(crossing)} dots, not in one'
    return _propagate_grid(tree, crossing[0], shape, pitch), ''


def _propagate_line(tree: scipy.spatial.cKDTree, start: np.ndarray, step: np.ndarray, count: int) -> list[int]:
    """Step 3, eqs 17 and 18: dots in sequence, each predicted by the last two; stops where there is none."""
    dots = [int(tree.query(start)[1])]
    reach = SEARCH * np.linalg.norm(step)
    while len(dots) < count:
        distance, dot = tree.query(tree.data[dots[-1]] + step, distance_upper_bound=reach)
        if not np.isfinite(distance):
            break
        step = tree.data[dot] - tree.data[dots[-1]]
        dots.append(int(dot))
    return dots


def _propagate_grid(tree: scipy.spatial.cKDTree, middle: int, shape: tuple[int, int], pitch: float) -> np.ndarray:
    """Step 5: outwards from the central dot, each dot predicted by two or three indexed ones."""
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
    """P'_ij by the first line of step 5's equation whose dots are indexed; next to the first dot, the constant vector of step 3."""
    for a, b in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        if (r + a, c + b) in places and (r + 2 * a, c + 2 * b) in places:
            return 2 * places[r + a, c + b] - places[r + 2 * a, c + 2 * b]
    for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        if {(r + a, c + b), (r + a, c), (r, c + b)} <= places.keys():
            return places[r + a, c] + places[r, c + b] - places[r + a, c + b]
    return places[row, column] + pitch * np.array([c - column, r - row])
