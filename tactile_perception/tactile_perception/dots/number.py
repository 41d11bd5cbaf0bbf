# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of dots, by name of the method: row and column on a printed grid, or tracks and registration of other patterns.

On a grid one image determines row and column of each dot where all printed rows and columns are seen. If an outer row is missing, the last
certain frame does where the pattern's irregularity (print, lens, press) excludes a shift by a pitch, or where the border of the image
agrees on which left; else no dot has a number. Kernels: src/dots/lattice.cpp, number.cpp, links.cpp.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _core
from .._core.dots import GridNumbering, GridNumbers, Lattice, Linker
from ..common.dots import Dots
from ..errors import BadArgument
from .pattern import PatternNumbers
from .published import PaperNumbering
from .sort import SortNumbers

_ON_GRID = 0.8  # of the dots, least that form the grid: more are missed or false on no sensor that could be used
_OBLIQUE = 0.34  # cosine: rows and columns of a printed grid are square to each other within 20 degrees of view; of hexagons 60 apart
_UNEQUAL = 2.0  # ratio of the pitches, largest
_OUTER_SHARE = 0.2  # of the other side, least dots of an outer row, as the numbering has it


@dataclass
class Numbered:
    """Indexed dots of an earlier frame: uv (N, 2) px, id (N,) int64."""

    uv: np.ndarray
    id: np.ndarray


def number_grid(uv: np.ndarray, rows: int, columns: int, previous: Numbered | None = None) -> GridNumbers:
    """Row and column of dots at uv (N, 2) px, in any order, on a printed grid of rows x columns; row 0 on top, column 0 left.

    previous: the last certain frame, which tells the rows where some are hidden. Rows may be rotated by up to 38 degrees. Raises
    BadArgument for a grid smaller than 2 x 2 or uv of another shape.
    """
    uv = np.asarray(uv, np.float64)
    if uv.ndim != 2 or uv.shape[1] != 2:
        raise BadArgument(f'uv must have the shape (N, 2), not {uv.shape}')
    numbering = GridNumbering(rows, columns)
    if previous is not None:
        numbering.remember(np.asarray(previous.uv, float), np.asarray(previous.id, np.int64))
    return numbering.number(uv)


def find_lattice(uv: np.ndarray, angle_hint: float = 0.0) -> Lattice | None:
    """Relative row and column indices of dots, or None if they form no grid.

    uv: (N, 2) px, finite; angle_hint: rad, expected direction of the rows; of the four possible directions, the one within 45 degrees of
    it is returned.
    """
    lattice = _core.dots.find_lattice(np.ascontiguousarray(uv, float), angle_hint)
    return lattice if lattice.found else None


class LinkedTracks:
    """Numbers of dots by a Linker, from frame to frame; pattern is ignored."""

    def __init__(self, pattern: np.ndarray | None = None):
        self._linker = Linker()

    def update(self, dots: Dots, stamp_s: float) -> np.ndarray:
        """Number (N,) of each dot's track at stamp_s, s."""
        return self._linker.update(dots.uv, stamp_s)


def find_grid(uv: np.ndarray) -> tuple[int, int]:
    """(rows, columns) of the grid that dots at uv (N, 2) px form, as far as it is seen; (0, 0) where most of them form none."""
    uv = uv[np.isfinite(uv).all(axis=1)]
    lattice = find_lattice(uv)
    if lattice is None or lattice.member.mean() < _ON_GRID:
        return 0, 0
    member = lattice.member.astype(bool)
    index = lattice.rc[member][:, ::-1]
    across, down = np.linalg.lstsq(np.column_stack([index, np.ones(len(index))]), uv[member], rcond=None)[0][:2]
    lengths = np.hypot(*across), np.hypot(*down)
    if abs(across @ down) > _OBLIQUE * lengths[0] * lengths[1] or max(lengths) > _UNEQUAL * min(lengths):
        return 0, 0
    columns = _extent(index[:, 0], 2)
    rows = _extent(index[:, 1], _OUTER_SHARE * columns)
    columns = _extent(index[:, 0], _OUTER_SHARE * rows)
    return (rows, columns) if min(rows, columns) >= 2 else (0, 0)


def _extent(index, least) -> int:
    """Number of rows from the first to the last one that has at least so many dots."""
    full = np.flatnonzero(np.bincount(index - index.min()) >= max(least, 2))
    return int(np.ptp(full)) + 1 if len(full) else 0


METHODS = {'lattice': GridNumbering, 'paper': PaperNumbering}  # (rows, columns) -> object with number(uv, width, height) -> GridNumbers
AUTO, REGISTER, SORT = 'auto', 'register', 'sort'
#: (pattern) -> object with update(dots, stamp_s) -> ids
WITHOUT_GRID = {'tracks': LinkedTracks, REGISTER: PatternNumbers, SORT: SortNumbers}


def grid_numbering(name: str, rows: int, columns: int):
    """A fresh object of that name in METHODS for a printed grid. Raises BadArgument for an unknown name and a grid smaller than 2 x 2."""
    if name not in METHODS:
        raise BadArgument(f'numbering method {name!r} is unknown: choose from {", ".join((AUTO, *METHODS, *WITHOUT_GRID))}')
    return METHODS[name](rows, columns)
