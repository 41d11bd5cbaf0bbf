# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Linking of dots from frame to frame by linear assignment with a constant velocity prediction, for patterns without a grid."""
from __future__ import annotations

import numpy as np

from tactile_perception._core import link_places, nearest_others
from tactile_perception.errors import BadArgument

NEW, TRACKED, LOST = 0, 1, 2
FARTHEST = 1e9  # px: positions beyond it are invalid


class Linker:
    """Tracks of dots; ids are never reused.

    gate: search range, median spacings from the predicted position; confirm: frames in a row before a dot that appears later is reported
    (NEW until then); keep_s: s that a LOST track is kept. Raises BadArgument for values out of range.
    """

    def __init__(self, gate: float = 0.7, confirm: int = 3, keep_s: float = 2.0):
        if not (gate > 0 and confirm >= 1 and keep_s >= 0):
            raise BadArgument(f'gate > 0, confirm >= 1 and keep_s >= 0 are needed, not {gate}, {confirm}, {keep_s}')
        self._gate, self._confirm, self._keep_s = gate, confirm, keep_s
        self._next_id = 0
        self.reset()

    def reset(self) -> None:
        """Forget all tracks; ids continue."""
        self.id = np.zeros(0, np.int64)
        self.uv = np.zeros((0, 2))
        self.state = np.zeros(0, np.uint8)
        self._first_uv = np.zeros((0, 2))
        self._velocity = np.zeros((0, 2))
        self._seen = np.zeros(0, np.int64)
        self._seen_s = np.zeros(0)

    def update(self, uv: np.ndarray, stamp_s: float) -> np.ndarray:
        """Track id (N,) int64 of each dot at uv (N, 2) px, -1 while NEW and for invalid positions; stamp_s, s, must increase."""
        uv = np.asarray(uv, float)
        good = np.abs(uv).max(axis=1, initial=0.0) < FARTHEST
        if good.all():
            return self._update(uv, stamp_s)
        number = np.full(len(uv), -1)
        number[good] = self._update(uv[good], stamp_s)
        return number

    def _update(self, uv: np.ndarray, stamp_s: float) -> np.ndarray:
        first = not len(self.id)
        track, dot = self._assign(uv, stamp_s)
        self._advance(track, uv[dot], stamp_s)
        self._retire(stamp_s)
        number = np.full(len(uv), -1)
        number[dot] = track_id = self._linked_id
        number[dot[~np.isin(track_id, self.id[self.state == TRACKED])]] = -1
        free = np.setdiff1d(np.arange(len(uv)), dot)
        born = self._begin(uv[free], stamp_s, self._confirm if first else 1)
        if first or self._confirm == 1:
            number[free] = born
        return number

    def _assign(self, uv: np.ndarray, stamp_s: float) -> tuple[np.ndarray, np.ndarray]:
        """Indices of tracks and of the dots linked to them, by the best of three predictions: constant velocity, last and first positions.

        The first positions cover a press that ends between two frames.
        """
        ahead = np.minimum(stamp_s - self._seen_s, self._keep_s)[:, None] * (self.state != LOST)[:, None]
        gate = self._gate * _spacing(self.uv)
        best, least = None, np.inf
        for places in (self.uv + self._velocity * ahead, self.uv, self._first_uv):
            track, dot = assign(places, uv, gate)
            cost = np.sum((places[track] - uv[dot]) ** 2) - len(track) * gate**2
            if cost < least:
                best, least = (track, dot), cost
        return best

    def _advance(self, track: np.ndarray, uv: np.ndarray, stamp_s: float) -> None:
        self._linked_id = self.id[track]
        elapsed = (stamp_s - self._seen_s[track])[:, None]
        follows = (self.state[track] != LOST)[:, None] & (elapsed > 0)
        self._velocity[track] = np.where(follows, (uv - self.uv[track]) / np.where(elapsed > 0, elapsed, 1), 0)
        self.uv[track] = uv
        self._seen_s[track] = stamp_s
        self._seen[track] += 1
        missed = np.ones(len(self.id), bool)
        missed[track] = False
        self.state[track] = np.where(self._seen[track] >= self._confirm, TRACKED, NEW)
        self.state[missed & (self.state == TRACKED)] = LOST
        self._seen[missed & (self.state == NEW)] = -1  # a NEW track that is missed once is dropped

    def _retire(self, stamp_s: float) -> None:
        keep = (self._seen >= 0) & ((self.state != LOST) | (stamp_s - self._seen_s <= self._keep_s))
        for name in ('id', 'uv', 'state', '_first_uv', '_velocity', '_seen', '_seen_s'):
            setattr(self, name, getattr(self, name)[keep])

    def _begin(self, uv: np.ndarray, stamp_s: float, seen: int) -> np.ndarray:
        count = len(uv)
        born = np.arange(self._next_id, self._next_id + count)
        self._next_id += count
        self.id = np.r_[self.id, born]
        self.uv = np.vstack([self.uv, uv])
        self._first_uv = np.vstack([self._first_uv, uv])
        self.state = np.r_[self.state, np.full(count, TRACKED if seen >= self._confirm else NEW, np.uint8)]
        self._velocity = np.vstack([self._velocity, np.zeros((count, 2))])
        self._seen = np.r_[self._seen, np.full(count, seen)]
        self._seen_s = np.r_[self._seen_s, np.full(count, float(stamp_s))]
        return born


def assign(places: np.ndarray, dots: np.ndarray, gate: float) -> tuple[np.ndarray, np.ndarray]:
    """One-to-one links between places (M, 2) and dots (N, 2), px, closer than gate, with the least sum of squares.

    Returns indices (K,) of places and of dots. An unlinked place costs the gate squared
    (kernel link_places: src/dots/index/assignment.cpp).
    """
    if not gate > 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    place, dot = link_places(np.asarray(places, float), np.asarray(dots, float), gate=gate).T
    return place, dot


def _spacing(uv: np.ndarray) -> float:
    """Median distance, px, to the nearest other dot; 0 for fewer than two."""
    return float(np.median(nearest_others(uv, count=1)[1])) if len(uv) > 1 else 0.0
