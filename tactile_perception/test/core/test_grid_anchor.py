# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel anchor_lattice (src/dots/index/grid_anchor.cpp), by dots.index.grid_origin, against the same steps in NumPy."""
from dataclasses import dataclass

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import anchor_lattice as kernel
from tactile_perception.dots.index.grid_origin import anchor_lattice

OUTER_SHARE = 0.2
CLIPPED_SHARE = 0.75
NEAR = 0.35
STAYED_SHARE = 0.8
STILL = 0.2
UNEVEN_RATIO = 0.5
CUT = 0.25
MOST_CLIPPED = 2
_NAMES = ('rows', 'columns')


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


def reference(rc, uv, shape, pitch, previous=None, image_size=None):
    """(offset (2,), reason), step by step; previous: (uv, rc) of the last frame."""
    offset = np.zeros(2, np.int64)
    extents = [_extent(rc, axis, shape) for axis in (0, 1)]
    if None in extents:
        return offset, f'no {_NAMES[extents.index(None)]} with enough dots'
    whole = all(extent.seen == extent.printed for extent in extents)
    vote = None if whole else _vote_of_last_frame(rc, uv, pitch, previous)
    for axis, extent in enumerate(extents):
        beyond = (0.0, 0.0) if whole else _beyond(rc, uv, axis, extent, image_size, pitch)
        window, reason = _window(extent, _vote_along(vote, axis, extent.first), beyond, previous is None)
        if reason:
            return offset, reason
        offset[axis] = -extent.first - window
    return offset, ''


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


def bulged(rng, rows, columns, pitch=20.0):
    """Places (N, 2) px of a domed grid and its rows and columns (N, 2)."""
    rc = np.stack(np.divmod(np.arange(rows * columns), columns), axis=1)
    p = rc[:, ::-1] - (np.array([columns, rows]) - 1) / 2
    uneven = rng.uniform(0, 0.3) / max(rows, columns)**2
    return pitch * p * (1.1 - uneven * (p**2).sum(axis=1, keepdims=True)) + [160, 130] + rng.normal(0, 0.2, p.shape), rc


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(3, 12), columns=st.integers(3, 12), more=st.integers(-2, 3),
       cut=st.floats(-40, 40), known=st.booleans(), sized=st.booleans())
@settings(max_examples=300, deadline=None)
def test_the_kernel_is_the_steps_in_numpy(seed, rows, columns, more, cut, known, sized):
    rng = np.random.default_rng(seed)
    uv, rc = bulged(rng, rows, columns)
    shape = (max(rows - more, 2), columns)
    printed = (rc < shape).all(axis=1)
    previous = (uv[printed] + rng.normal(0, 3), rc[printed]) if known else None
    size = (int(320 + cut), int(260 - cut)) if sized else None
    seen = (uv[:, 0] > rng.uniform(-50, 80)) & (uv[:, 1] < rng.uniform(200, 300)) & (rng.random(len(uv)) < 0.97)
    uv, rc = uv[seen] + rng.uniform(-6, 6, 2), rc[seen] + [3, 5]
    offset, reason = reference(rc - rc.min(axis=0), uv, shape, 20.0, previous, size) if len(rc) else ([0, 0], 'no rows with enough dots')
    before = (previous[0], previous[1] @ [shape[1], 1]) if known else None
    found = anchor_lattice(uv, rc, np.ones(len(rc), bool), shape, 20.0, before, size)
    assert found.reason == reason
    if not reason:
        at = rc - rc.min(axis=0) + offset
        inside = ((at >= 0) & (at < shape)).all(axis=1)
        np.testing.assert_array_equal(found.id, np.where(inside, at @ [shape[1], 1], -1))
    else:
        assert (found.id == -1).all()


@pytest.mark.parametrize('wrong', [{'rows': 0}, {'columns': 10**6}, {'pitch': np.nan}, {'width': -1.0}, {'height': np.inf}])
def test_numbers_are_checked(wrong):
    uv, rc = bulged(np.random.default_rng(0), 4, 5)
    given = {'rows': 4, 'columns': 5, 'pitch': 20.0, 'width': 320, 'height': 260} | wrong
    with pytest.raises(ValueError, match=f'^{next(iter(wrong))}: '):
        kernel(uv, rc, np.ones(20, bool), np.zeros((0, 2)), np.zeros(0, np.int64), **given)
