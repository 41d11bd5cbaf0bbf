# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Links between two sets of positions in images, and tracks of the dots of a pattern without a grid, from frame to frame."""
from __future__ import annotations

import numpy as np

from .. import _core
from ..common.dots import Dots
from ..common.neighbours import Neighbours
from .constants import DOT

FARTHEST = 1e9  # px: positions beyond it are invalid


def link_positions(positions: np.ndarray, dots: np.ndarray, gate: float) -> np.ndarray:
    """Links (K, 2), position and dot, between positions (M, 2) and dots (N, 2), px, finite, that are each other's nearest and
    closer than gate, px; sorted by position."""
    if not (len(positions) and len(dots)):
        return np.zeros((0, 2), int)
    away, dot = Neighbours(dots).query(positions)
    position = np.flatnonzero(away < gate)
    dot = dot[position]
    mutual = Neighbours(positions).query(dots[dot])[1] == position
    return np.stack([position, dot], axis=1)[mutual]


#: A track: uv, first: px, last and first position; velocity: px/s; since_s, seen_s: stamps of the first and of the last frame with it.
_TRACK = np.dtype([('id', int), ('uv', float, 2), ('first', float, 2), ('velocity', float, 2), ('since_s', float), ('seen_s', float),
                   ('known', bool)])


class Linker:
    """Tracks the dots of a pattern without a grid.

    The displacement of a sensor's skin is continuous, and a regular pattern that moves by half its spacing looks like one that moved by as
    much in the opposite direction. Links that contradict those of their neighbours, or another motion that is nearly as probable, are none
    (`src/dots/links.hpp`). A dot that appears later is reported once it is confirmed; ids are never used again.

    Parameters
    ----------
    pattern : ndarray, optional
        Ignored; other numberings of patterns without a grid take it.

    Attributes
    ----------
    lost : int
        How often so far a track got no link because two dots could continue it.
    far : int
        How many frames so far were more than half a spacing, or an unknown motion, from the frame before.
    restarts : int
        How often all tracks were lost.
    """

    def __init__(self, pattern: np.ndarray | None = None):
        self._next, self._tracks, self.lost, self.far, self.restarts = 0, np.zeros(0, _TRACK), 0, 0, 0

    def update(self, dots: Dots, stamp_s: float, size: tuple[float, float] = (np.inf, np.inf)) -> np.ndarray:
        """Identify the dots of the next frame.

        Parameters
        ----------
        dots : Dots
            Dots of the frame; those without a finite position get no id.
        stamp_s : float
            Time of the frame, s, later than that of the last one.
        size : tuple of float
            Width and height of the image, px, whose borders dots may cross unseen.

        Returns
        -------
        ndarray of int64, shape (N,)
            Id of each dot, -1 while it is new.
        """
        id = np.full(len(dots.uv), -1)
        good = np.flatnonzero((np.abs(dots.uv) < FARTHEST).all(axis=1))
        uv, before = dots.uv[good], self._tracks
        track, dot, position, spacing = self._linked(uv, stamp_s, size)
        unlinked = np.delete(before, track)
        unlinked['uv'], unlinked['velocity'] = np.delete(position, track, axis=0), 0
        unlinked = unlinked[unlinked['known'] & (stamp_s - unlinked['seen_s'] <= DOT.kept_s)]
        starts, new = not len(track) and not len(unlinked), np.delete(np.arange(len(uv)), dot)
        self.restarts += starts and len(before) > 0
        if len(unlinked) and len(new):  # a dot that may be that of an unlinked track is no other one
            new = new[Neighbours(unlinked['uv']).query(uv[new])[0] > DOT.max_new_distance * spacing]
        seen, fresh = before[track], np.zeros(len(new), _TRACK)
        elapsed = np.maximum(stamp_s - seen['seen_s'], DOT.min_interval_s)[:, None]
        seen['velocity'] = (uv[dot] - seen['uv']) / elapsed
        fresh['id'], fresh['first'], fresh['since_s'] = self._next + np.arange(len(new)), uv[new], stamp_s
        self._next += len(new)
        seen, dot = np.concatenate([seen, fresh]), np.concatenate([dot, new])
        seen['uv'], seen['seen_s'] = uv[dot], stamp_s
        seen['known'] |= (stamp_s - seen['since_s'] >= DOT.confirmed_s) | starts
        self._tracks = np.concatenate([seen, unlinked])
        id[good[dot]] = np.where(seen['known'], seen['id'], -1)
        return id

    def _linked(self, uv: np.ndarray, stamp_s: float, size: tuple) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Tracks (K,) and dots (K,) that are linked; positions (M, 2) px of all tracks, as their neighbours move; spacing, px."""
        tracks = self._tracks
        if len(tracks) < 2 or not len(uv):
            return np.zeros(0, int), np.zeros(0, int), tracks['uv'], 0.0
        predicted = tracks['uv'] + np.minimum(stamp_s - tracks['seen_s'], DOT.kept_s)[:, None] * tracks['velocity']
        seen = tracks['seen_s'] == tracks['seen_s'].max()
        links = _core.dots.link_tracks(tracks['uv'], np.clip(predicted, -FARTHEST, FARTHEST), tracks['first'], seen, uv, size)
        track = np.flatnonzero(links.dot >= 0)
        dot = links.dot[track]
        right = np.ones(len(track), bool)
        together = np.flatnonzero(tracks['since_s'][track] == tracks['since_s'].min())  # first positions of one state of the skin
        right[together] = _core.dots.continuous(tracks['first'][track[together]], uv[dot[together]])
        self.lost += links.ambiguous + np.count_nonzero(~right)
        track, dot = track[right], dot[right]
        if not len(track) or np.median(np.hypot(*(uv[dot] - tracks['uv'][track]).T)) > DOT.max_common_motion * links.spacing:
            self.far += 1
        return track, dot, links.position if len(track) else tracks['uv'], links.spacing
