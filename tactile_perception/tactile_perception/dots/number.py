# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of dots, by name of the method: row and column on a printed grid, or tracks and registration of other patterns.

On a grid relative rows and columns follow from one image, by links and, over gaps, by extrapolation (kernel: src/dots/lattice.cpp). Their
origin on the print follows where all printed rows and columns are seen. If an outer row is missing, the last certain frame shows it where
the pattern's irregularity (print, lens, press) excludes a shift by a pitch; else no dot has a number.
"""
from __future__ import annotations

import numpy as np

from tactile_driver.plugins import PluginTable

from .. import _core
from .._core.dots import Lattice
from ..common.dots import GridNumbers
from ..common.statistics import upper_median
from ..common.surface import scatter
from ..core.errors import BadArgument
from .links import FARTHEST, Linker
from .pattern import PatternNumbers

_MOST_TURNED = 38.0  # degrees: rotated further, rows and columns may be exchanged
_FEW_LINKED = 0.7  # of the dots: with fewer linked, the reason gives their number
_LONGEST = 2000  # rows, columns of a grid: bounds the memory

# Origin of a lattice on the printed grid
_OUTER_SHARE = 0.2  # of the printed length, least number of dots of an outer row; fewer are false dots
_CLIPPED_SHARE = 0.75  # of the median row, most dots of an outer row that may be dropped if too many are seen
_MOST_CLIPPED = 2  # surplus rows that may be dropped
_NEAR = 0.35  # pitches within which a dot continues one of the last frame: below half a pitch
_STAYED_SHARE = 0.8  # of the dots, that must continue for the last numbers to be used
_MAX_STILL_MOTION = 0.2  # pitches, largest median motion from the last frame that needs less evidence
_UNEVEN_RATIO = 0.5  # spread of motions at the right numbers over that one row off, below which it is excluded
_STILL_RATIO = 0.8  # the same where little moved: an even grid, which shows no difference, has one
_FEWEST_MOVES = 8  # motions that give a spread
_SAMPLE = 20  # dots whose nearest ones of the last frame give the offset: bounds the time

# A grid of unknown size
_ON_GRID = 0.8  # of the dots, least that form the grid: more are missed or false on no sensor that could be used
_OBLIQUE = 0.34  # cosine: rows and columns of a printed grid are square to each other within 20 degrees of view; of hexagons 60 apart
_UNEQUAL = 2.0  # ratio of the pitches, largest


def number_grid(uv: np.ndarray, rows: int, columns: int) -> GridNumbers:
    """Row and column of dots at uv (N, 2) px, in any order, on a printed grid of rows x columns; row 0 on top, column 0 left. Rows may be
    rotated by up to 38 degrees. Raises BadArgument for a grid smaller than 2 x 2 or uv of another shape."""
    uv = np.asarray(uv, np.float64)
    if uv.ndim != 2 or uv.shape[1] != 2:
        raise BadArgument(f'uv must have the shape (N, 2), not {uv.shape}')
    return GridNumbering(rows, columns).number(uv)


class GridNumbering:
    """Row and column of dots on a printed grid of rows x columns; row 0 on top, column 0 left. Rows may be rotated by up to 38 degrees.

    Each frame is numbered by itself; the last certain one, or the first, shows which rows are seen where some are hidden or more come into
    view. whole: whether the print has no more rows and columns; then an image of so many shows them alone. Raises BadArgument for a grid
    smaller than 2 x 2.
    """

    def __init__(self, rows: int, columns: int, whole: bool = True):
        if not (2 <= rows <= _LONGEST and 2 <= columns <= _LONGEST):
            raise BadArgument(f'a grid has at least 2 rows and 2 columns, not {rows} x {columns}; use rows = columns = 0 with the tracker '
                              'for other patterns')
        self._printed, self._whole = (rows, columns), whole
        self._before: list[np.ndarray] = []  # (rows * columns, 2) px, of the last certain frame and the first

    def number(self, uv: np.ndarray, width: float = 0, height: float = 0) -> GridNumbers:
        """GridNumbers of dots at uv (N, 2) px, in any order; rows that are no positions get -1. The published method needs width and height
        of the image; this one does not."""
        good = np.flatnonzero(np.logical_and(*(np.abs(uv.T) < FARTHEST)))
        id, pitch = np.full(len(uv), -1), np.nan
        try:
            lattice = self._lattice(uv.take(good, axis=0))
            pitch, member = lattice.pitch, np.flatnonzero(lattice.member)
            rc, good = lattice.rc.take(member, axis=0), good[member]
            uv = uv.take(good, axis=0)
            rc += self._origin(uv, rc, pitch, len(lattice.member))
        except _NotCertain as error:
            return GridNumbers(id, str(error), pitch)
        number, inside = _numbers(rc, self._printed)
        id[good[inside]] = number
        if len(number):
            self._before = [scatter(uv.take(inside, axis=0), number, self._printed[0] * self._printed[1]), *self._before[-1:]]
        return GridNumbers(id, '', pitch)

    def _origin(self, uv, rc, pitch, found) -> np.ndarray:
        """See _Origin, of the last certain frame, or else of the first. Raises _NotCertain."""
        reasons = []
        for before in self._before or [None]:
            try:
                return _Origin(uv, rc, pitch, self._printed, before, self._whole or before is None).find(found)
            except _NotCertain as error:
                reasons.append(error)
        raise reasons[0]

    @staticmethod
    def _lattice(uv: np.ndarray) -> Lattice:
        lattice = find_lattice(uv)
        if lattice is None:
            raise _NotCertain(f'{len(uv)} dots found do not form a consistent grid')
        if abs(np.degrees(lattice.angle)) > _MOST_TURNED:
            raise _NotCertain(f'rows run at {np.degrees(lattice.angle):.0f} degrees: rows and columns are ambiguous')
        return lattice


class _NotCertain(Exception):
    """Why no dot is numbered."""


class _Origin:
    """What to add to relative rows and columns rc (N, 2) of dots at uv (N, 2) px to get printed ones. The last certain frame, before
    (rows * columns, 2) px or None, decides where the irregularity of the pattern excludes a shift by a pitch; else one image does where all
    printed rows and columns are seen. whole: whether the print has no more than these; else one image alone shows nothing."""

    def __init__(self, uv: np.ndarray, rc: np.ndarray, pitch: float, printed: tuple[int, int], before: np.ndarray | None, whole: bool):
        self._uv, self._rc, self._pitch, self._printed, self._before, self._whole = uv, rc, pitch, printed, before, whole
        self._still = False

    def find(self, found: int) -> np.ndarray:
        """(2,) of the dots, of which so many were found. Raises _NotCertain."""
        try:
            extents = [_extent(self._rc[:, axis], _OUTER_SHARE * self._printed[1 - axis]) for axis in (0, 1)]
            offset = None if self._before is None else self._continued(np.array([-first for first, _ in extents]))
            return np.array([self._place(axis, name, offset, *extents[axis]) for axis, name in enumerate(('rows', 'columns'))])
        except _NotCertain as error:
            if len(self._rc) >= _FEW_LINKED * found:
                raise
            raise _NotCertain(f'of {found} dots found ({np.prod(self._printed)} configured) only {len(self._rc)} are linked: '
                              f'{error}') from error

    def _place(self, axis: int, name: str, offset: np.ndarray | None, first: int, counts: np.ndarray) -> int:
        printed, seen, window = self._printed[axis], len(counts), 0  # window: number of printed row 0 among the seen ones
        if not seen:
            raise _NotCertain(f'no {name} with enough dots')
        by_last = None if offset is None else -int(offset[axis]) - first
        if seen == printed and (by_last == 0 or by_last is None and self._whole):
            return -first
        if by_last is not None and self._fits_only_here(offset, axis, _STILL_RATIO if self._still and seen < printed else _UNEVEN_RATIO):
            return -first - by_last
        if seen < printed + (not self._whole):
            raise _NotCertain(f'{seen} of {printed} {name} seen, and which is ambiguous: let the camera see all of them once, or set '
                              f'{name} to those it sees')
        if seen > printed:  # incomplete rows at the ends are dropped, those that the last frame had not; else it is another pattern
            sums = np.convolve(counts, np.ones(printed, int), 'valid')
            window = int(sums.argmax())
            dropped = max(counts[:window].max(initial=0), counts[window + printed:].max(initial=0))
            if seen - printed > _MOST_CLIPPED or dropped > _CLIPPED_SHARE * np.median(counts):
                raise _NotCertain(f'{seen} {name} of dots seen, {printed} configured: is it another pattern?')
            if self._before is not None and by_last != window:
                raise _NotCertain(f'{seen} {name} of dots seen, {printed} configured, and the last frame had others')
        return -first - window

    def _continued(self, guess: np.ndarray) -> np.ndarray | None:
        """(2,) offset at which nearly all dots continue those of the last frame, of two where they may; None without one."""
        for offset_of in (lambda: guess, self._of_nearest):
            offset = offset_of()
            moved = np.hypot(*self._moves(offset).T)
            stayed = moved < _NEAR * self._pitch
            if np.count_nonzero(stayed) >= max(_STAYED_SHARE * min(len(self._uv), np.isfinite(self._before[:, 0]).sum()), 1):
                self._still = upper_median(moved[stayed]) < _MAX_STILL_MOTION * self._pitch
                return offset
        return None

    def _of_nearest(self) -> np.ndarray:
        """(2,) offset of some of the dots from those of the last frame that are nearest; 0 without any near ones."""
        at = np.flatnonzero(np.isfinite(self._before[:, 0]))
        some = slice(None, None, max(1, len(self._uv) // _SAMPLE))
        (u, v), before = self._uv[some].T, self._before[at]
        square = (u[:, None] - before[:, 0])**2 + (v[:, None] - before[:, 1])**2
        nearest = square.argmin(axis=1)
        near = square[np.arange(len(square)), nearest] < (_NEAR * self._pitch)**2
        offsets = (np.stack(np.divmod(at[nearest], self._printed[1]), axis=1) - self._rc[some])[near]
        return np.array([upper_median(offsets[:, axis]) for axis in (0, 1)], int) if len(offsets) else np.zeros(2, int)

    def _moves(self, offset: np.ndarray) -> np.ndarray:
        """(M, 2) px, motions since the last frame of the dots that it shows at rows and columns that are so much higher."""
        number, inside = _numbers(self._rc + offset, self._printed)
        moves = self._uv.take(inside, axis=0) - self._before.take(number, axis=0)
        return moves.compress(np.isfinite(moves[:, 0]), axis=0)

    def _fits_only_here(self, offset: np.ndarray, axis: int, ratio: float) -> bool:
        """Whether the irregularity of the pattern fits the last frame at this offset, and much worse one row (or column) further."""
        spreads = []
        for shift in (0, -1, 1):
            moves = self._moves(offset + shift * np.eye(2, dtype=int)[axis])
            if len(moves) < _FEWEST_MOVES:
                return False
            spreads.append(np.median(np.abs(moves - np.median(moves, axis=0)).sum(axis=1)))
        return bool(spreads[0] < ratio * min(spreads[1:]))


def find_lattice(uv: np.ndarray) -> Lattice | None:
    """Relative row and column indices of dots at uv (N, 2) px, finite, or None if they form no grid; rows run within 45 degrees of u."""
    lattice = _core.dots.find_lattice(np.ascontiguousarray(uv, float))
    return lattice if lattice.found else None


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
    columns = len(_extent(index[:, 0], 2)[1])
    rows = len(_extent(index[:, 1], _OUTER_SHARE * columns)[1])
    columns = len(_extent(index[:, 0], _OUTER_SHARE * rows)[1])
    return (rows, columns) if min(rows, columns) >= 2 else (0, 0)


def _numbers(rc: np.ndarray, printed: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Numbers (M,) on the printed grid of those of rows and columns rc (N, 2) that are on it, and which those are (M,)."""
    row, column = rc.T
    inside = np.flatnonzero((row >= 0) & (row < printed[0]) & (column >= 0) & (column < printed[1]))
    return (row * printed[1] + column)[inside], inside


def _extent(index: np.ndarray, least: float) -> tuple[int, np.ndarray]:
    """The first row that has at least so many dots, and two; and the numbers of dots of the rows from there to the last such one."""
    low = int(index.min(initial=0))
    counts = np.bincount(index - low)
    full = np.flatnonzero(counts >= max(least, 2))
    return (low + int(full[0]), counts[full[0]:full[-1] + 1]) if len(full) else (0, counts[:0])


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
