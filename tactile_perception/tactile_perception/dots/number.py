# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of dots, by name of the method: row and column on a printed grid, or tracks and registration of other patterns.

On a grid one image determines row and column of each dot where all printed rows and columns are seen. If an outer row is missing, it either
left the image (its position lies outside) or the numbers of the last frame continue (motion below half a pitch). A shift by exactly one
pitch with an occluded outer row is unobservable; such frames are rejected. Kernels: src/dots/lattice.cpp, number.cpp, links.cpp.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _core
from .._core.dots import GridNumbering, GridNumbers, Lattice, Linker
from ..errors import BadArgument
from .pattern import PatternNumbers
from .published import PaperNumbering


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
    uv = np.asarray(uv, np.float64)
    if uv.ndim != 2 or uv.shape[1] != 2:
        raise BadArgument(f'uv must have the shape (N, 2), not {uv.shape}')
    numbering = GridNumbering(rows, columns)
    if previous is not None:
        numbering.remember(np.asarray(previous.uv, float), np.asarray(previous.id, np.int64))
    return numbering.number(uv, *(image_size or (0, 0)))


def find_lattice(uv: np.ndarray, angle_hint: float = 0.0) -> Lattice | None:
    """Relative row and column indices of dots, or None if they form no grid.

    uv: (N, 2) px, finite; angle_hint: rad, expected direction of the rows; of the four possible directions, the one within 45 degrees of
    it is returned.
    """
    lattice = _core.dots.find_lattice(np.ascontiguousarray(uv, float), angle_hint)
    return lattice if lattice.found else None


def tracks(pattern: np.ndarray | None = None) -> Linker:
    """A Linker of dots from frame to frame; pattern is ignored."""
    return Linker()


METHODS = {'lattice': GridNumbering, 'paper': PaperNumbering}  # (rows, columns) -> object with number(uv, width, height) -> GridNumbers
REGISTER = 'register'
WITHOUT_GRID = {'tracks': tracks, REGISTER: PatternNumbers}  # (pattern) -> object with update(uv, stamp_s) -> ids


def grid_numbering(name: str, rows: int, columns: int):
    """A fresh object of that name in METHODS for a printed grid. Raises BadArgument for an unknown name and a grid smaller than 2 x 2."""
    if name not in METHODS:
        raise BadArgument(f'numbering method {name!r} is unknown: choose from {", ".join((*METHODS, *WITHOUT_GRID))}')
    return METHODS[name](rows, columns)
