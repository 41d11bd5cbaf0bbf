# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Links between two sets of places in images, and tracks of the dots of a pattern without a grid, from frame to frame."""
from __future__ import annotations

import numpy as np
import scipy

from ..common.dots import Dots

FARTHEST = 1e9  # px: positions beyond it are invalid

_GATE = 0.7  # median spacings from its predicted position, within which a dot is searched
_CLEAR = 0.2  # of that, root mean square distance from predictions up to which no other ones are tried: bounds the time
_CONFIRMED_S = 0.05  # s, that a dot which appears later is followed before it is reported: false ones last a frame or two
_KEPT_S = 2.0  # s, that a lost track is kept
_SHORTEST_S = 1e-6  # s, between two frames: bounds velocities


def link_places(places: np.ndarray, dots: np.ndarray, gate: float) -> np.ndarray:
    """Links (K, 2), place and dot, between places (M, 2) and dots (N, 2), px, finite, that are each other's nearest and closer than gate,
    px; sorted by place."""
    if not (len(places) and len(dots)):
        return np.zeros((0, 2), int)
    away, dot = scipy.spatial.cKDTree(dots).query(places, distance_upper_bound=gate)
    place = np.flatnonzero(away < gate)
    dot = dot[place]
    mutual = scipy.spatial.cKDTree(places).query(dots[dot])[1] == place
    return np.stack([place, dot], axis=1)[mutual]


#: A track: uv, first: px, last and first position; velocity: px/s; since_s, seen_s: stamps of the first and of the last frame with it.
_TRACK = np.dtype([('id', int), ('uv', float, 2), ('first', float, 2), ('velocity', float, 2), ('since_s', float), ('seen_s', float),
                   ('known', bool)])


class Linker:
    """Tracks of dots by mutual nearest neighbours; ids are never used again. A dot that appears later is reported once it is confirmed.
    pattern is ignored."""

    def __init__(self, pattern: np.ndarray | None = None):
        self._next, self._tracks = 0, np.zeros(0, _TRACK)

    def update(self, dots: Dots, stamp_s: float) -> np.ndarray:
        """Id (N,) int64 of each dot, -1 while it is new and for those without a position; stamp_s, s, must increase."""
        uv = dots.uv
        id = np.full(len(uv), -1)
        good = np.flatnonzero((np.abs(uv) < FARTHEST).all(axis=1))
        seen, before = np.zeros(len(good), _TRACK), self._tracks
        track, dot = self._best_links(uv[good], stamp_s).T
        seen[dot] = before[track]
        new = np.ones(len(good), bool)
        new[dot] = False
        seen['id'][new] = self._next + np.arange(np.count_nonzero(new))
        self._next += np.count_nonzero(new)
        seen['first'][new], seen['since_s'][new] = uv[good][new], stamp_s
        elapsed = np.maximum(stamp_s - before['seen_s'][track], _SHORTEST_S)[:, None]
        seen['velocity'][dot] = (uv[good][dot] - before['uv'][track]) / elapsed
        seen['uv'], seen['seen_s'] = uv[good], stamp_s
        seen['known'] |= (stamp_s - seen['since_s'] >= _CONFIRMED_S) | (len(before) == 0)
        lost = np.delete(before, track)
        lost = lost[lost['known'] & (stamp_s - lost['seen_s'] <= _KEPT_S)]
        lost['velocity'] = 0
        self._tracks = np.concatenate([seen, lost])
        id[good] = np.where(seen['known'], seen['id'], -1)
        return id

    def _best_links(self, uv: np.ndarray, stamp_s: float) -> np.ndarray:
        """Links (K, 2) of tracks and dots by the best of three predictions: constant velocity, last and first positions. The first
        positions cover a press that ends between two frames."""
        tracks, best, least = self._tracks, np.zeros((0, 2), int), np.inf
        if len(tracks) < 2:
            return best
        gate = _GATE * float(np.median(scipy.spatial.cKDTree(tracks['uv']).query(tracks['uv'], 2)[0][:, 1]))
        moved = tracks['uv'] + np.minimum(stamp_s - tracks['seen_s'], _KEPT_S)[:, None] * tracks['velocity']
        for expected in (np.clip(moved, -FARTHEST, FARTHEST), tracks['uv'], tracks['first']):
            links = link_places(expected, uv, gate)
            square = np.square(expected[links[:, 0]] - uv[links[:, 1]]).sum()
            if square - len(links) * gate**2 < least:
                best, least = links, square - len(links) * gate**2
            if len(links) == len(tracks) and square < len(links) * (_CLEAR * gate)**2:
                break
        return best
