# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which printed row and column a found lattice begins with, and whether that is certain.

One image tells it when as many rows and columns are seen as are printed. Where an outer row is not seen, either it left the image (its
place lies outside) or the numbers of the last frame go on (nothing moved by half a pitch). A whole row hidden inside the image while
everything moved by a whole pitch cannot be told from nothing having moved: then nothing is certain.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

OUTER_SHARE = 0.2  # of the printed length: an outer row with fewer dots than that is false dots, or hardly seen
CLIPPED_SHARE = 0.75  # an outer row with fewer dots than that may be left out where more rows are seen than were configured
NEAR = 0.35  # pitches: a dot nearer than this to a place of the last frame has stayed
STAYED_SHARE = 0.8  # of the dots: so many must have stayed for the last numbers to go on
STILL = 0.2  # pitches: less than that, and nothing has moved
UNEVEN_RATIO = 0.5  # the spread of moves at the right numbers, against that one row further: what tells a move by a whole pitch
CUT = 0.25  # pitches: a dot nearer than this to the border is cut by it, and may not be found

MOST_CLIPPED = 2  # rows more than printed that may be left out so
_NAMES = ('rows', 'columns')


@dataclass
class Anchor:
    """offset: (2,) int64 row and column to add to relative ones; certain; reason: empty, or why not."""

    offset: np.ndarray
    certain: bool
    reason: str


@dataclass
class _Extent:
    """Rows (or columns) of which enough dots are seen.

    first: relative number of the first one; seen: how many; counts: dots in each from the first on; printed: how many there are.
    """

    name: str
    first: int
    seen: int
    counts: np.ndarray
    printed: int


def anchor_lattice(rc, uv, shape, pitch, previous=None, image_size=None) -> Anchor:
    """Offset of relative rows and columns rc (N, 2) of dots at uv (N, 2) px on a printed grid of shape (rows, columns).

    pitch: px; previous: (uv, rc) of the last certain frame, or None; image_size: (width, height) px, or None where not known.
    """
    offset = np.zeros(2, np.int64)
    extents = [_extent(rc, axis, shape) for axis in (0, 1)]
    if None in extents:
        return Anchor(offset, False, f'no {_NAMES[extents.index(None)]} with enough dots')
    whole = all(extent.seen == extent.printed for extent in extents)
    vote = None if whole else _stayed(rc, uv, pitch, previous)
    for axis, extent in enumerate(extents):
        beyond = (0.0, 0.0) if whole else _beyond(rc, uv, axis, extent, image_size, pitch)
        window, reason = _window(extent, _said(vote, axis, extent.first), beyond, previous is None)
        if reason:
            return Anchor(offset, False, reason)
        offset[axis] = -extent.first - window
    return Anchor(offset, True, '')


@dataclass
class _Vote:
    """What the last frame says. offset: (2,) int64; sure: for rows and for columns, whether a move by a whole pitch can be ruled out."""

    offset: np.ndarray
    sure: list[bool]
    still: bool


def _stayed(rc, uv, pitch, previous) -> _Vote | None:
    """The offset at which nearly all dots are where they were in the last frame, or None."""
    if previous is None or not len(previous[0]):
        return None
    distance, nearest = cKDTree(previous[0]).query(uv, distance_upper_bound=NEAR * pitch)
    near = np.isfinite(distance)
    enough = STAYED_SHARE * min(len(uv), len(previous[0]))
    if near.sum() < enough:
        return None
    offsets = previous[1][nearest[near]] - rc[near]
    offset = np.median(offsets, axis=0).astype(np.int64)
    if np.all(offsets == offset, axis=1).sum() < enough:
        return None
    still = np.median(distance[near]) < STILL * pitch
    return _Vote(offset, [_fits_only_here(rc + offset, uv, previous, axis) for axis in (0, 1)], bool(still))


def _fits_only_here(rc, uv, previous, axis) -> bool:
    """Whether the last frame's own unevenness fits at these numbers, and much worse one row (or column) further either way."""
    top = np.maximum(previous[1].max(axis=0), rc.max(axis=0)) + 3
    places = np.full((*top, 2), np.nan)
    places[previous[1][:, 0], previous[1][:, 1]] = previous[0]
    spread = []
    for shift in (0, -1, 1):
        at = rc + shift * (np.arange(2) == axis)
        known = np.all(at >= 0, axis=1)
        move = uv[known] - places[at[known, 0], at[known, 1]]
        move = move[np.isfinite(move[:, 0])]
        if len(move) < 8:
            return False
        spread.append(np.median(np.abs(move - np.median(move, axis=0)).sum(axis=1)))
    return spread[0] < UNEVEN_RATIO * min(spread[1:])


def _said(vote: _Vote | None, axis: int, first: int) -> tuple[int, bool, bool] | None:
    """(which of the rows seen is printed row 0, whether that is sure, whether nothing moves) by the last frame, or None."""
    return None if vote is None else (int(-vote.offset[axis] - first), vote.sure[axis], vote.still)


def _extent(rc, axis, shape) -> _Extent | None:
    counts = np.bincount(rc[:, axis])
    full = np.flatnonzero(counts >= max(2, OUTER_SHARE * shape[1 - axis]))
    if not len(full):
        return None
    first, last = int(full[0]), int(full[-1])
    return _Extent(_NAMES[axis], first, last - first + 1, counts[first: last + 1], shape[axis])


def _window(extent, vote, beyond, is_first) -> tuple[int, str]:
    """(which of the rows seen is printed row 0, ''), below zero where that is not seen; or (0, reason)."""
    if extent.seen == extent.printed:
        return 0, ''
    if extent.seen > extent.printed:
        return _leave_out_clipped(extent, vote)
    return _place_part(extent, vote, beyond, is_first)


def _leave_out_clipped(extent, vote) -> tuple[int, str]:
    """More rows than printed: those at the ends that are clearly not whole are left out, else it is another pattern."""
    spare = extent.seen - extent.printed
    best = int(np.convolve(extent.counts, np.ones(extent.printed), 'valid').argmax())
    left_out = np.r_[extent.counts[:best], extent.counts[best + extent.printed:]]
    if spare <= MOST_CLIPPED and left_out.max() <= CLIPPED_SHARE * np.median(extent.counts):
        return best, ''
    if spare <= MOST_CLIPPED and vote is not None and 0 <= vote[0] <= spare:
        return vote[0], ''
    return 0, f'{extent.seen} {extent.name} of dots seen, {extent.printed} configured: is it another pattern?'


def _place_part(extent, vote, beyond, is_first) -> tuple[int, str]:
    """Fewer rows than printed are seen: where they belong, by which side left the image and by what stayed.

    Where the pattern reaches beyond the image on both sides and no numbers are given yet, the nearer side's row is taken for the cut one.
    """
    missing = extent.printed - extent.seen
    before, after = beyond
    by_border = {(True, False): -missing, (False, True): 0}.get((before > 0, after > 0))
    by_vote, sure, still = (None, False, False) if vote is None or not 0 <= -vote[0] <= missing else vote
    seen = f'only {extent.seen} of {extent.printed} {extent.name} seen'
    if by_border is not None and by_vote is not None and by_border != by_vote and not sure:
        return 0, f'{seen}; the border and the last frame disagree on which'
    wider = before > 0 and after > 0  # the pattern reaches beyond the image on both sides: where it ends is never seen
    chosen = by_vote if sure or (still and wider) else by_border
    if chosen is None and is_first and missing == 1 and wider:
        chosen = -1 if before < after else 0
    return (0, f'{seen}, and nothing tells which') if chosen is None else (chosen, '')


def _beyond(rc, uv, axis, extent, image_size, pitch) -> tuple[float, float]:
    """How far (px, median) the row before the first and the one after the last would lie outside the image; 0 for inside or not known."""
    if image_size is None or extent.seen < 2:
        return 0.0, 0.0
    first, last = extent.first, extent.first + extent.seen - 1
    answer = []
    for outer, inner in ((first, first + 1), (last, last - 1)):
        place = np.median(uv[rc[:, axis] == outer], axis=0)
        place = uv[rc[:, axis] == outer] + (place - np.median(uv[rc[:, axis] == inner], axis=0)) * (np.arange(2) != axis)
        border = pitch * CUT
        outside = np.maximum(border - place, place + border - (np.asarray(image_size) - 1)).max(axis=1)
        answer.append(max(0.0, float(np.median(outside))))
    return answer[0], answer[1]
