# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Methods that index dots, by name: METHODS for printed grids, WITHOUT_GRID for other patterns."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from tactile_perception.dots.index.grid import GridNumbers, Numbered, number_grid
from tactile_perception.dots.index.linker import FARTHEST, Linker
from tactile_perception.dots.index.point_set_registration import PatternNumbers
from tactile_perception.dots.index.published import number_by_paper
from tactile_perception.errors import BadArgument


def numbering_method(name: str) -> Callable[..., GridNumbers]:
    """The function (uv, rows, columns, previous, image_size) -> GridNumbers of that name in METHODS. Raises BadArgument for an unknown
    name."""
    if name not in METHODS:
        raise BadArgument(f'numbering method {name!r} is unknown: choose from {", ".join(METHODS)}')
    return METHODS[name]


def paper(uv: np.ndarray, rows: int, columns: int, previous: Numbered | None = None, image_size: tuple | None = None) -> GridNumbers:
    """Section 3.5 of touchpad_contact_region (number_by_paper); previous is ignored. Raises BadArgument without image_size."""
    if image_size is None:
        raise BadArgument('numbering method paper starts at fixed points of the image: give image_size (width, height), px')
    uv, id = np.asarray(uv, np.float64), np.full(len(uv), -1)
    good = np.flatnonzero(np.abs(uv).max(axis=1, initial=0.0) < FARTHEST)
    id[good], reason = number_by_paper(uv[good], (rows, columns), image_size)
    return GridNumbers(id, reason, np.nan)


def nearest(uv: np.ndarray, rows: int, columns: int, previous: Numbered | None = None, image_size: tuple | None = None) -> GridNumbers:
    """Nearest neighbour in the last frame, one to one, as a baseline; the first frame by number_grid."""
    if previous is None or not len(previous.id) or not len(uv):
        return number_grid(uv, rows, columns, None, image_size)
    distance, dot = scipy.spatial.cKDTree(previous.uv).query(uv)
    order = np.argsort(-distance)
    closest = np.full(len(previous.id), -1)
    closest[dot[order]] = order  # written in order of falling distance: the nearest remains
    id = np.full(len(uv), -1)
    taken = np.flatnonzero(closest >= 0)
    id[closest[taken]] = previous.id[taken]
    return GridNumbers(id, '', np.nan)


def tracks(pattern: np.ndarray | None = None) -> Linker:
    """A Linker of dots from frame to frame; pattern is ignored."""
    return Linker()


METHODS = {'lattice': number_grid, 'paper': paper, 'nearest': nearest}
REGISTER = 'register'
WITHOUT_GRID = {'tracks': tracks, REGISTER: PatternNumbers}
