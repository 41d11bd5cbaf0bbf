# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The same contact from frame to frame: regions of dots or taxels and the contacts that they continue."""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .constants import COMMON
from .surface import Moments


def may_continue(seen_s: float, last_s: float, stamp_s: float) -> bool:
    """Whether a contact that was last seen at seen_s may continue in the frame at stamp_s: the last frame, at last_s, had it, however long
    ago, since frames may be refused; or it was seen lately."""
    return seen_s >= min(last_s, stamp_s - COMMON.max_gap_s)


@dataclass(frozen=True)
class TrackedContact:
    """number: id of the contact, never reused; moments: of its region; since_s, seen_s: stamps of the first and the last frame with it;
    merged: whether several contacts have merged into the region."""

    number: int
    moments: Moments
    since_s: float
    seen_s: float
    merged: bool

    @property
    def is_persistent(self) -> bool:
        """Whether it has been there for longer than a transient."""
        return self.seen_s - self.since_s > COMMON.min_persistent_s - 1e-6


class ContactTracker:
    """A region continues the contact with which it shares most dots (or taxels), one to one; without common ones, the nearest within reach
    from border to border. A region that continues none is a new contact. One that shares dots with a persistent contact that ends
    has merged with it, until a part splits off."""

    def __init__(self):
        self._next = 1
        self.reset()

    def reset(self) -> None:
        """All regions are new contacts; ids are not reused."""
        self._last: list[TrackedContact] = []
        self._stamp_s = -np.inf  # of the last frame
        self._owner = np.zeros(0, int)  # of each dot or taxel: that of the last contacts, from 1, which it belonged to last, 0 for none

    def assign(self, labels: np.ndarray, regions: Sequence[tuple[int, Moments]], reach: float, stamp_s: float) -> list[TrackedContact]:
        """The contact of each region, a label and moments, in their order. labels: of each dot or taxel, 0 outside of the regions; reach:
        m; stamp_s: s."""
        last, owner = self._remembered(labels.size, stamp_s)
        self._stamp_s = stamp_s
        inside = [labels.ravel() == label for label, _ in regions]
        shared = [np.bincount(owner[mask], minlength=len(last) + 1).tolist() for mask in inside]  # with no contact, and with each
        counts, shared = [sum(common) for common in shared], [common[1:] for common in shared]
        continued = _matched(shared, [moments for _, moments in regions], last, reach)
        free, found = [j for j in range(len(last)) if j not in continued.values()], []
        for k, (_, moments) in enumerate(regions):
            if k not in continued:
                found.append(TrackedContact(self._next, moments, stamp_s, stamp_s, False))
                self._next += 1
                continue
            before = last[continued[k]]
            splits = any(i != k and common[continued[k]] and counts[i] >= COMMON.min_split for i, common in enumerate(shared))
            joined = any(shared[k][j] and last[j].is_persistent for j in free)
            found.append(TrackedContact(before.number, moments, before.since_s, stamp_s, bool(joined or before.merged and not splits)))
        lost = [j for j in free if not any(common[j] for common in shared)]
        again = np.zeros(len(last) + 1, int)
        again[[j + 1 for j in lost]] = len(found) + 1 + np.arange(len(lost))
        self._last, self._owner = found + [last[j] for j in lost], again[owner]
        for k, mask in enumerate(inside):
            self._owner[mask] = k + 1
        return found

    def _remembered(self, size: int, stamp_s: float) -> tuple[list[TrackedContact], np.ndarray]:
        """The contacts that may continue, and the one that each of so many dots belonged to."""
        kept = [j for j, one in enumerate(self._last) if may_continue(one.seen_s, self._stamp_s, stamp_s)]
        if len(self._owner) != size:
            return [self._last[j] for j in kept], np.zeros(size, int)
        if len(kept) == len(self._last):
            return self._last, self._owner
        number = np.zeros(len(self._last) + 1, int)
        number[np.array(kept, int) + 1] = np.arange(len(kept)) + 1
        return [self._last[j] for j in kept], number[self._owner]


def _matched(shared: list[list[int]], regions: list[Moments], last: list[TrackedContact], reach: float) -> dict[int, int]:
    """Index of the contact that each region continues: greedily by most common dots, then by the smallest gap."""
    before, pairs = [(one.moments.centroid, math.sqrt(one.moments.area / math.pi), one.number) for one in last], []
    for k, moments in enumerate(regions):
        centroid, radius = moments.centroid, math.sqrt(moments.area / math.pi)
        for j, (old, large, number) in enumerate(before):
            gap = math.dist(centroid, old) - radius - large
            if shared[k][j] or gap < reach:
                pairs.append((-shared[k][j], gap, number, k, j))
    continued: dict[int, int] = {}
    for *_, k, j in sorted(pairs):
        if k not in continued and j not in continued.values():
            continued[k] = j
    return continued
