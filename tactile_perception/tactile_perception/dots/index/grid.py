# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Indexing of a printed grid: row and column of each dot, from a single frame."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_perception._core import all_within, reject_outliers
from tactile_perception.dots.index.grid_origin import anchor_lattice
from tactile_perception.dots.index.lattice import find_lattice
from tactile_perception.dots.index.repair import complete_grid
from tactile_perception.errors import BadArgument

MAX_ANGLE = np.deg2rad(38.0)  # rotation beyond which rows and columns may be exchanged. Chosen: below 45 degrees, with tolerance
_FEW_LINKED = 0.7  # of the dots: with fewer linked, the message gives their number. Chosen
_FARTHEST = 1e12  # px: no image is wider; what is further, or NaN, is no position


@dataclass
class GridNumbers:
    """Indices of N dots.

    id: (N,) int64, row * columns + column, -1 where not certain; reason: empty, or why no dot is indexed; pitch: px.
    """

    id: np.ndarray
    reason: str
    pitch: float

    @property
    def certain(self) -> bool:
        """Whether the frame is indexed; single dots may still have -1."""
        return not self.reason


@dataclass
class Numbered:
    """Indexed dots of an earlier frame: uv (N, 2) px, id (N,) int64."""

    uv: np.ndarray
    id: np.ndarray


def number_grid(uv: np.ndarray, rows: int, columns: int, previous: Numbered | None = None, image_size: tuple | None = None) -> GridNumbers:
    """Row and column of dots at uv (N, 2) px, in any order, on a printed grid of rows x columns; row 0 on top, column 0 left.

    previous: the last certain frame, used where outer rows are hidden; image_size: (width, height) px, to detect that an outer row
    left the image. Rows may be rotated by up to 38 degrees. Raises BadArgument for a grid smaller than 2 x 2 or uv of another shape.
    """
    uv = _checked(uv, rows, columns)
    if all_within(uv, most=_FARTHEST):
        return _number(uv, (rows, columns), previous, image_size)
    good = np.flatnonzero((np.abs(uv) <= _FARTHEST).all(axis=1))
    numbers = _number(uv[good], (rows, columns), previous, image_size)
    id = np.full(len(uv), -1)
    id[good] = numbers.id
    return GridNumbers(id, numbers.reason, numbers.pitch)


def _checked(uv: np.ndarray, rows: int, columns: int) -> np.ndarray:
    uv = np.asarray(uv, np.float64)
    if uv.ndim != 2 or uv.shape[1] != 2:
        raise BadArgument(f'uv must have the shape (N, 2), not {uv.shape}')
    if rows < 2 or columns < 2:
        raise BadArgument(f'a grid has at least 2 rows and 2 columns, not {rows} x {columns}; '
                          'use rows = columns = 0 with the tracker for other patterns')
    return uv


def _number(uv, shape, previous, image_size) -> GridNumbers:
    id = np.full(len(uv), -1)
    lattice = find_lattice(uv)
    if lattice is None:
        return GridNumbers(id, f'{len(uv)} dots found do not form a consistent grid', np.nan)
    if abs(lattice.angle) > MAX_ANGLE:
        return GridNumbers(id, f'rows run at {np.degrees(lattice.angle):.0f} degrees: rows and columns are ambiguous', np.nan)
    before = None if previous is None else (np.asarray(previous.uv, float), np.asarray(previous.id, np.int64))
    anchor = anchor_lattice(uv, lattice.rc, lattice.member, shape, lattice.pitch, before, image_size)
    if anchor.reason:
        linked = np.count_nonzero(lattice.member)
        seen = f'of {len(uv)} dots found ({shape[0] * shape[1]} configured) only {linked} are linked: '
        return GridNumbers(id, (seen if linked < _FEW_LINKED * len(uv) else '') + anchor.reason, lattice.pitch)
    id = anchor.id
    if np.count_nonzero(id >= 0) < shape[0] * shape[1]:  # a complete grid is consistent already
        id = complete_grid(reject_outliers(id, uv, rows=shape[0], columns=shape[1]), uv, shape)
    return GridNumbers(id, '', lattice.pitch)
