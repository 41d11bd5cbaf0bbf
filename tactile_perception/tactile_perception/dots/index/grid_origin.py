# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Origin of a lattice on the printed grid: its first row and column, and whether that is certain.

One image determines it when all printed rows and columns are seen. If an outer row is missing, it either left the image (its position lies
outside) or the indices of the last frame continue (motion below half a pitch). A shift by exactly one pitch with an occluded outer row is
unobservable; such frames are rejected.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

OUTER_SHARE = 0.2  # of the printed length, least number of dots of an outer row; fewer are false dots. Chosen
CLIPPED_SHARE = 0.75  # of the median row, most dots of an outer row that may be dropped where too many rows are seen. Chosen
NEAR = 0.35  # pitches within which a dot continues one of the last frame. Chosen: below half a pitch
STAYED_SHARE = 0.8  # of the dots, that must continue for the last indices to be used. Chosen
STILL = 0.2  # pitches, largest median motion of a pattern at rest. Chosen
UNEVEN_RATIO = 0.5  # spread of displacements at the right indices over that one row further, below which a shift is excluded. Chosen
CUT = 0.25  # pitches: dots nearer to the border are cut by it and may be missed. Chosen: about a dot's radius

MOST_CLIPPED = 2  # surplus rows that may be dropped. Chosen
_NAMES = ('rows', 'columns')


@dataclass
class Anchor:
    """offset: (2,) int64, row and column to add to relative ones; certain: whether it is determined; reason: empty, or why not."""

    offset: np.ndarray
    certain: bool
    reason: str


@dataclass
class _Extent:
    """Rows (or columns) with enough dots.

    first: relative index of the first; seen: their number; counts: dots in each; printed: number of printed ones.
    """

    name: str
    first: int
    seen: int
    counts: np.ndarray
    printed: int


def anchor_lattice(rc, uv, shape, pitch, previous=None, image_size=None) -> Anchor:
    """Offset of relative rows and columns rc (N, 2) of dots at uv (N, 2) px on a printed grid of shape (rows, columns).

    pitch: px; previous: (uv, rc) of the last certain frame, or None; image_size: (width, height) px, or None.
    """
    offset = np.zeros(2, np.int64)
    extents = [_extent(rc, axis, shape) for axis in (0, 1)]
    if None in extents:
        return Anchor(offset, False, f'no {_NAMES[extents.index(None)]} with enough dots')
    whole = all(extent.seen == extent.printed for extent in extents)
    vote = None if whole else _vote_of_last_frame(rc, uv, pitch, previous)
    for axis, extent in enumerate(extents):
        beyond = (0.0, 0.0) if whole else _beyond(rc, uv, axis, extent, image_size, pitch)
        window, reason = _window(extent, _vote_along(vote, axis, extent.first), beyond, previous is None)
        if reason:
            return Anchor(offset, False, reason)
        offset[axis] = -extent.first - window
    return Anchor(offset, True, '')


@dataclass
class _Vote:
    """Offset (2,) int64 by the last frame. sure: for rows and columns, whether a shift by a whole pitch is excluded; still: whether nothing
    moved."""

    offset: np.ndarray
    sure: list[bool]
    still: bool


def _vote_of_last_frame(rc, uv, pitch, previous) -> _Vote | None:
    """The offset at which most dots continue those of the last frame, or None."""
    if previous is None or not len(previous[0]):
        return None
    distance, nearest = scipy.spatial.cKDTree(previous[0]).query(uv, distance_upper_bound=NEAR * pitch)
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
    """Whether the irregularity of the pattern fits the last frame at these indices, and much worse one row (or column) further."""
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


def _vote_along(vote: _Vote | None, axis: int, first: int) -> tuple[int, bool, bool] | None:
    """(index among the seen rows of printed row 0, sure, still) by the last frame, or None."""
    return None if vote is None else (int(-vote.offset[axis] - first), vote.sure[axis], vote.still)


def _extent(rc, axis, shape) -> _Extent | None:
    counts = np.bincount(rc[:, axis])
    full = np.flatnonzero(counts >= max(2, OUTER_SHARE * shape[1 - axis]))
    if not len(full):
        return None
    first, last = int(full[0]), int(full[-1])
    return _Extent(_NAMES[axis], first, last - first + 1, counts[first: last + 1], shape[axis])


def _window(extent, vote, beyond, is_first) -> tuple[int, str]:
    """(index among the seen rows of printed row 0, ''), negative where that is not seen; or (0, reason)."""
    if extent.seen == extent.printed:
        return 0, ''
    if extent.seen > extent.printed:
        return _drop_clipped(extent, vote)
    return _place_part(extent, vote, beyond, is_first)


def _drop_clipped(extent, vote) -> tuple[int, str]:
    """More rows than printed: drop incomplete rows at the ends, else report another pattern."""
    spare = extent.seen - extent.printed
    best = int(np.convolve(extent.counts, np.ones(extent.printed), 'valid').argmax())
    dropped = np.r_[extent.counts[:best], extent.counts[best + extent.printed:]]
    if spare <= MOST_CLIPPED and dropped.max() <= CLIPPED_SHARE * np.median(extent.counts):
        return best, ''
    if spare <= MOST_CLIPPED and vote is not None and 0 <= vote[0] <= spare:
        return vote[0], ''
    return 0, f'{extent.seen} {extent.name} of dots seen, {extent.printed} configured: is it another pattern?'


def _place_part(extent, vote, beyond, is_first) -> tuple[int, str]:
    """Fewer rows than printed: place them by the side that left the image and by the last frame.

    If the pattern extends beyond both sides of the first frame, the row on the nearer side is assumed missing.
    """
    missing = extent.printed - extent.seen
    before, after = beyond
    by_border = {(True, False): -missing, (False, True): 0}.get((before > 0, after > 0))
    by_vote, sure, still = (None, False, False) if vote is None or not 0 <= -vote[0] <= missing else vote
    seen = f'only {extent.seen} of {extent.printed} {extent.name} seen'
    if by_border is not None and by_vote is not None and by_border != by_vote and not sure:
        return 0, f'{seen}; the border and the last frame disagree on which'
    wider = before > 0 and after > 0  # the pattern extends beyond both sides of the image
    chosen = by_vote if sure or (still and wider) else by_border
    if chosen is None and is_first and missing == 1 and wider:
        chosen = -1 if before < after else 0
    return (0, f'{seen}, and which is ambiguous') if chosen is None else (chosen, '')


def _beyond(rc, uv, axis, extent, image_size, pitch) -> tuple[float, float]:
    """Median distance, px, outside the image of the row before the first and after the last; 0 for inside or unknown."""
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
