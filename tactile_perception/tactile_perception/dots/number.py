# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of dots, by name of the method: row and column on a printed grid, or tracks and registration of other patterns.

Grids: src/dots/numbering.hpp.
"""
from __future__ import annotations

import numpy as np

from tactile_driver.plugins import PluginTable

from .. import _core
from .._core.dots import GridNumbering, GridNumbers, Lattice
from ..core.errors import BadArgument
from .links import Linker
from .pattern import PatternNumbers


def number_grid(uv: np.ndarray, rows: int, columns: int) -> GridNumbers:
    """Row and column of dots at uv (N, 2) px, in any order, on a printed grid of rows x columns; row 0 on top, column 0 left. Rows may be
    rotated by up to 38 degrees. Raises BadArgument for a grid smaller than 2 x 2 or uv of another shape."""
    uv = np.asarray(uv, np.float64)
    if uv.ndim != 2 or uv.shape[1] != 2:
        raise BadArgument(f'uv must have the shape (N, 2), not {uv.shape}')
    return GridNumbering(rows, columns).number(uv)


def find_lattice(uv: np.ndarray) -> Lattice | None:
    """Relative row and column indices of dots at uv (N, 2) px, finite, or None if they form no grid; rows run within 45 degrees of u."""
    lattice = _core.dots.find_lattice(np.ascontiguousarray(uv, float))
    return lattice if lattice.found else None


#: (rows, columns) -> object with number(uv, width, height) -> GridNumbers
METHODS = PluginTable('tactile_perception.grid_numberings', {
    'lattice': GridNumbering,
    'paper': 'tactile_perception.published.touchpad_contact_region:PaperNumbering',
})
AUTO, REGISTER, SORT = 'auto', 'register', 'sort'
#: (pattern) -> object with update(dots, stamp_s) -> ids
WITHOUT_GRID = PluginTable('tactile_perception.numberings', {
    'tracks': Linker,
    REGISTER: PatternNumbers,
    SORT: 'tactile_perception.published.sort:SortNumbers',
})


def grid_numbering(name: str, rows: int, columns: int):
    """A fresh object of that name in METHODS for a printed grid. Raises BadArgument for an unknown name and a grid smaller than 2 x 2."""
    if name not in METHODS:
        raise BadArgument(f'numbering method {name!r} is unknown: choose from {", ".join((AUTO, *METHODS, *WITHOUT_GRID))}')
    return METHODS[name](rows, columns)
