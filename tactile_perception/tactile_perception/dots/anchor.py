# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which printed row and column a found lattice begins with, and whether that is certain.

One image tells it when as many rows and columns are seen as are printed. Where an outer row is not seen, either it left the image (its place lies
outside) or the numbers of the last frame go on (nothing moved by half a pitch). A whole row hidden inside the image while everything moved by
a whole pitch cannot be told from nothing having moved: then nothing is certain.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

OUTER_SHARE = 0.2  # of the printed length: an outer row with fewer dots than that is false dots, or hardly seen
CLIPPED_SHARE = 0.75  # an outer row with fewer dots than that may be left out where more rows are seen than were configured
NEAR = 0.35  # pitches: a dot nearer than this to a place of the last frame has stayed
STAYED_SHARE = 0.8  # of the dots: so many must have stayed for the last numbers to go on
OUTSIDE_SHARE = 0.5  # of an outer row's places: so many must lie outside the image for it to have left


@dataclass
class Anchor:
    """offset: (2,) int64 row and column to add to relative ones; certain; reason: empty, or why not."""

    offset: np.ndarray
    certain: bool
    reason: str


def anchor_lattice(rc, uv, shape, pitch, previous=None, image_size=None) -> Anchor:
    """Offset of relative rows and columns rc (N, 2) of dots at uv (N, 2) px on a printed grid of shape (rows, columns).

    pitch: px; previous: (uv, rc) of the last certain frame, or None; image_size: (width, height) px, or None where not known.
    """
    vote = _stayed(rc, uv, pitch, previous)
    offset = np.zeros(2, np.int64)
    for axis in (0, 1):
        found, reason = _anchor_axis(rc, uv, axis, shape, None if vote is None else vote[axis], image_size, pitch)
        if reason:
            return Anchor(offset, False, reason)
        offset[axis] = found
    return Anchor(offset, True, '')


def _stayed(rc, uv, pitch, previous) -> np.ndarray | None:
    """The offset (2,) at which nearly all dots are where they were in the last frame, or None."""
    if previous is None or not len(previous[0]):
        return None
    distance, nearest = cKDTree(previous[0]).query(uv, distance_upper_bound=NEAR * pitch)
    near = np.isfinite(distance)
    if near.sum() < STAYED_SHARE * len(uv):
        return None
    offsets = previous[1][nearest[near]] - rc[near]
    middle = np.median(offsets, axis=0).astype(np.int64)
    agree = np.all(offsets == middle, axis=1).sum()
    return middle if agree >= STAYED_SHARE * len(uv) else None


def _anchor_axis(rc, uv, axis, shape, vote, image_size, pitch) -> tuple[int, str]:
    """(offset, '') along one axis, or (0, reason)."""
    counts = np.bincount(rc[:, axis])
    full = np.flatnonzero(counts >= max(2, OUTER_SHARE * shape[1 - axis]))
    name = ('rows', 'columns')[axis]
    if not len(full):
        return 0, f'no {name} with enough dots'
    first, seen, printed = int(full[0]), int(full[-1] - full[0] + 1), shape[axis]
    if seen == printed:
        return -first, ''
    if seen > printed:
        return _leave_out_clipped(counts, first, seen, printed, name, vote)
    left_image = _left_image(rc, uv, axis, first, first + seen - 1, image_size, pitch)
    return _place_part(first, seen, printed, name, vote, left_image)


def _leave_out_clipped(counts, first, seen, printed, name, vote) -> tuple[int, str]:
    """More rows than printed: those at the ends that are clearly not whole are left out, else it is another pattern."""
    spare = seen - printed
    sums = np.convolve(counts[first: first + seen], np.ones(printed), 'valid')
    best = int(sums.argmax())
    clipped = np.r_[counts[first: first + best], counts[first + best + printed: first + seen]]
    if spare <= 2 and clipped.max() <= CLIPPED_SHARE * np.median(counts[first: first + seen]):
        return -(first + best), ''
    if spare <= 2 and vote is not None and 0 <= -vote - first <= spare:
        return int(vote), ''
    return 0, f'{seen} {name} of dots seen, {printed} configured: is it another pattern?'


def _place_part(first, seen, printed, name, vote, left_image) -> tuple[int, str]:
    """Fewer rows than printed are seen: where they belong, by which side left the image and by what stayed."""
    missing = printed - seen
    before, after = left_image
    by_border = {(True, False): missing, (False, True): 0}.get((before, after))
    by_vote = None if vote is None or not 0 <= vote + first <= missing else int(vote + first)
    if by_border is None and by_vote is None:
        return 0, f'only {seen} of {printed} {name} seen, and nothing tells which'
    if by_border is not None and by_vote is not None and by_border != by_vote:
        return 0, f'only {seen} of {printed} {name} seen; the border and the last frame disagree on which'
    chosen = by_vote if by_vote is not None else by_border
    return chosen - first, ''


def _left_image(rc, uv, axis, first, last, image_size, pitch) -> tuple[bool, bool]:
    """Whether the row before the first and the one after the last would lie outside the image (or cut by its border)."""
    if image_size is None:
        return False, False
    answer = []
    for outer, inner in ((first, first + 1), (last, last - 1)):
        step = np.median(uv[rc[:, axis] == outer], axis=0) - np.median(uv[rc[:, axis] == inner], axis=0)
        place = uv[rc[:, axis] == outer] + step[axis - 1] * np.eye(2)[axis - 1]
        margin = pitch / 4
        outside = np.any((place < margin) | (place > np.asarray(image_size) - 1 - margin), axis=1)
        answer.append(bool(outside.mean() >= OUTSIDE_SHARE))
    return answer[0], answer[1]
