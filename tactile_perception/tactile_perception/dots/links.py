# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Links between two sets of positions in images, and tracks of the dots of a pattern without a grid, from frame to frame.

The displacement of a sensor's skin is continuous, and a regular pattern that moves by half its spacing looks like one that moved by as much
the other way. Links that contradict those of their neighbours are dropped, and all links are where the pattern shifted by a spacing
explains the dots nearly as well.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from ..common.dots import Dots

FARTHEST = 1e9  # px: positions beyond it are invalid

_HALF = 0.5  # spacings: a dot nearer than that to where a track is expected may be that of the track
_GATE = 0.7  # median spacings from its predicted position, within which a dot is searched
_NEIGHBOURS = 8  # of a dot: a square grid has as many within one step
_MAX_STRAIN = 0.5  # difference of two neighbours' displacements over their distance: beyond it the nearest dot may be the neighbour's
_MOTION = 0.2  # spacings, standard deviation of the common motion between two frames about its prediction: a prior
_UNSEEN = np.log(20)  # nats: one of 20 dots is missed in a frame, or false
_CERTAIN = np.log(1e4)  # nats, by which links must be likelier than those of a pattern shifted by a spacing
_RELEASED = np.log(1e6)  # nats: one of a million frames shows the end of a press that the frame before shows in full
_SAME_STEP, _SAME_DOT = 0.4, 0.3  # spacings: of a neighbour from a step, and of a dot from where a shifted pattern has one
_MAX_CONTESTED = 0.25  # of the links: as many tracks and dots that are near each other without a link are no accident
_MAX_STEPS = 3  # shifts by a spacing that are followed between two frames
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
    """Tracks of dots by mutual nearest neighbours whose displacements are continuous; ids are never used again. A dot that appears later is
    reported once it is confirmed. pattern is ignored.

    lost: how often so far a track got no link because two dots could claim it; far: how many frames so far were more than half a spacing,
    or an unknown motion, from the frame before; restarts: how often all tracks were lost.
    """

    def __init__(self, pattern: np.ndarray | None = None):
        self._next, self._tracks, self.lost, self.far, self.restarts = 0, np.zeros(0, _TRACK), 0, 0, 0

    def update(self, dots: Dots, stamp_s: float, size: tuple[float, float] = (np.inf, np.inf)) -> np.ndarray:
        """Id (N,) int64 of each dot, -1 while it is new and for those without a position; stamp_s, s, must increase; size: width and
        height of the image, px, whose borders dots may cross unseen."""
        id = np.full(len(dots.uv), -1)
        good = np.flatnonzero((np.abs(dots.uv) < FARTHEST).all(axis=1))
        uv, before = dots.uv[good], self._tracks
        (track, dot), place, spacing = self._certain_links(uv, stamp_s, np.array(size, float))
        unlinked = np.delete(before, track)
        unlinked['uv'], unlinked['velocity'] = np.delete(place, track, axis=0), 0
        unlinked = unlinked[unlinked['known'] & (stamp_s - unlinked['seen_s'] <= _KEPT_S)]
        starts, new = not len(track) and not len(unlinked), np.delete(np.arange(len(uv)), dot)
        self.restarts += starts and len(before) > 0
        if len(unlinked) and len(new):  # a dot that may be that of an unlinked track is no other one
            new = new[scipy.spatial.cKDTree(unlinked['uv']).query(uv[new])[0] > _HALF * spacing]
        seen, fresh = before[track], np.zeros(len(new), _TRACK)
        elapsed = np.maximum(stamp_s - seen['seen_s'], _SHORTEST_S)[:, None]
        seen['velocity'] = (uv[dot] - seen['uv']) / elapsed
        fresh['id'], fresh['first'], fresh['since_s'] = self._next + np.arange(len(new)), uv[new], stamp_s
        self._next += len(new)
        seen, dot = np.concatenate([seen, fresh]), np.concatenate([dot, new])
        seen['uv'], seen['seen_s'] = uv[dot], stamp_s
        seen['known'] |= (stamp_s - seen['since_s'] >= _CONFIRMED_S) | starts
        self._tracks = np.concatenate([seen, unlinked])
        id[good[dot]] = np.where(seen['known'], seen['id'], -1)
        return id

    def _certain_links(self, uv: np.ndarray, stamp_s: float, size: np.ndarray):
        """Tracks and dots (2, K) that are linked, none where a pattern shifted by a spacing explains the dots about as well; positions
        (M, 2) px of all tracks, as their neighbours move; spacing, px."""
        tracks = self._tracks
        if len(tracks) < 2 or not len(uv):
            return np.zeros((2, 0), int), tracks['uv'], 0.0
        moved = tracks['uv'] + np.minimum(stamp_s - tracks['seen_s'], _KEPT_S)[:, None] * tracks['velocity']
        matcher = _Matcher(tracks, np.clip(moved, -FARTHEST, FARTHEST), uv, size)
        match, is_certain = matcher.best()
        is_certain = is_certain and len(match.links) > 0
        self.lost += match.contested if is_certain else int(matcher.seen.sum())
        track, dot = match.links.T
        if not is_certain or np.median(np.hypot(*(uv[dot] - tracks['uv'][track]).T)) > _HALF * matcher.spacing:
            self.far += 1
        return ((track, dot), match.place, matcher.spacing) if is_certain else (np.zeros((2, 0), int), tracks['uv'], matcher.spacing)


@dataclass(frozen=True)
class _Match:
    """links: (K, 2) track and dot; contested: how many tracks have no link while a dot near them has none, too; score: nats; residual:
    spacings, typical distance from the prediction; place: (M, 2) px, of all tracks, of those without a link by their neighbours."""

    links: np.ndarray
    contested: int
    score: float
    residual: float
    place: np.ndarray

    @property
    def is_contested(self) -> bool:
        """Whether so many dots could be those of tracks without a link that the motion may be another one."""
        return self.contested >= _MAX_CONTESTED * len(self.links)


class _Matcher:
    """Hypotheses about which of the dots uv (N, 2) px continue which tracks (M,), expected at moved (M, 2) px; size: (2,) px of the image.

    spacing: px, typical distance of neighbours; seen: (M,) bool, tracks that were seen in the last frame.
    """

    def __init__(self, tracks: np.ndarray, moved: np.ndarray, uv: np.ndarray, size: np.ndarray):
        self._at, self._uv, self._size = tracks['uv'], uv, size
        self._expected = (moved, 0.0), (tracks['uv'], 0.0), (tracks['first'], _RELEASED)
        distance, near = scipy.spatial.cKDTree(self._at).query(self._at, min(_NEIGHBOURS + 1, len(tracks)))
        self._near, self.spacing = near[:, 1:], max(float(np.median(distance[:, 1])), 1e-6)
        self._pitch = np.maximum(distance[:, 1], 1e-6)
        self._pair = np.repeat(np.arange(len(tracks)), near.shape[1] - 1), self._near.ravel()
        self._limit = _MAX_STRAIN * np.minimum(*self._pitch[np.stack(self._pair)])
        self.seen = tracks['seen_s'] == tracks['seen_s'].max()
        self._dots = scipy.spatial.cKDTree(uv)

    def best(self) -> tuple[_Match, bool]:
        """The match with the highest score, and whether it is certain."""
        moved, at, first = (expected for expected, _ in self._expected)
        match = self._match(moved)
        for starts in ((at, first), (at + share * step * self._pitch[:, None] for step in self._steps() for share in (0.5, 1.0))):
            if match.is_contested:
                match = max([match, *map(self._match, starts)], key=lambda one: one.score)
        for _ in range(_MAX_STEPS):
            if match.score > _CERTAIN - (1 - match.residual)**2 / (2 * _MOTION**2):
                return match, not match.is_contested  # the prior alone excludes a shift
            score, place = max((self._shifted(match, step) for step in self._steps()), key=lambda one: one[0])
            if match.score > score + _CERTAIN:
                return match, not match.is_contested
            if match.score > score - _CERTAIN:
                break
            match = self._match(place)
        return match, False

    def _steps(self) -> np.ndarray:
        """(K, 2) from the track in the middle to its neighbours, over its distance from the nearest one."""
        middle = np.argmin(np.hypot(*(self._at - self._at[self.seen].mean(axis=0)).T) + np.where(self.seen, 0, np.inf))
        return (self._at[self._near[middle]] - self._at[middle]) / self._pitch[middle]

    def _match(self, expected: np.ndarray) -> _Match:
        """By the dots nearest to expected positions (M, 2) px, and again where the neighbours' links say, while that finds more."""
        match = self._nearest(expected)
        while match.contested:
            again = self._nearest(match.place)
            if len(again.links) <= len(match.links):
                break
            match = again
        return match

    def _nearest(self, expected: np.ndarray) -> _Match:
        claimed = link_places(expected, self._uv, _GATE * self.spacing)
        shift = np.full_like(self._at, np.nan)
        shift[claimed[:, 0]] = self._uv[claimed[:, 1]] - self._at[claimed[:, 0]]
        kept = self._continuous(shift)
        links = claimed[kept[claimed[:, 0]]]
        shift[~kept] = np.nan
        place = self._at + _filled(shift, self._near)
        surprise = self._surprise(place)
        score = -_UNSEEN * self._unexplained(place, *links.T) - surprise
        track, dot = links.T
        contested = link_places(np.delete(place, track, axis=0), np.delete(self._uv, dot, axis=0), self.spacing)
        return _Match(links, len(contested), score, _MOTION * np.sqrt(2 * surprise), place)

    def _continuous(self, shift) -> np.ndarray:
        """(M,) bool: tracks with a displacement (M, 2) px, less those in a part that is torn from a larger one."""
        track, near = self._pair
        is_torn = np.hypot(*(shift[track] - shift[near]).T) >= self._limit
        torn = np.zeros(len(shift), bool)
        torn[track[is_torn]] = torn[near[is_torn]] = True
        if not is_torn.any():
            return np.isfinite(shift[:, 0])
        joined = ~(is_torn | torn[near] | np.isnan(shift[track, 0] + shift[near, 0]))
        inner = joined & ~torn[track]
        graph = scipy.sparse.coo_array((inner[inner], (track[inner], near[inner])), shape=(len(shift), len(shift)))
        part = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
        size = np.bincount(part)
        by_size = np.flatnonzero(joined & torn[track])
        by_size = by_size[np.argsort(size[part[near[by_size]]])]
        part[track[by_size]] = part[near[by_size]]  # a torn track is of the largest part beside it
        one, other = part[track[is_torn]], part[near[is_torn]]
        lost = one[(one != other) & (size[one] <= size[other])]
        return np.isfinite(shift[:, 0]) & ~torn & ~np.isin(part, lost)

    def _shifted(self, match: _Match, step: np.ndarray) -> tuple[float, np.ndarray]:
        """Score of a match shifted by one step (2,), spacings, and the positions (M, 2) px of its tracks."""
        steps = match.place[self._near] - match.place[:, None]
        steps = np.concatenate([steps, -steps], axis=1)  # at the edge of the pattern the opposite neighbour shows the step
        step = step * self._pitch[:, None]
        error = np.hypot(*(steps - step[:, None]).transpose(2, 0, 1))
        nearest, rows = error.argmin(axis=1), np.arange(len(error))
        steps = np.where((error[rows, nearest] < _SAME_STEP * self._pitch)[:, None], steps[rows, nearest], step)
        place = match.place + steps
        away, dot = self._dots.query(place)
        good = np.flatnonzero(away < _SAME_DOT * np.hypot(*steps.T))
        return -_UNSEEN * self._unexplained(place, good, dot[good]) - self._surprise(place), place

    def _unexplained(self, place, track, dot) -> int:
        """How many tracks at positions (M, 2) px but track (K,), and dots but dot (K,), are within the image now and were in the last."""
        shift = np.median((place - self._at)[self.seen], axis=0)
        missed, false = self.seen & self._inside(place), self._inside(self._uv) & self._inside(self._uv - shift)
        missed[track] = false[dot] = False
        return np.count_nonzero(missed) + np.count_nonzero(false)

    def _inside(self, uv: np.ndarray) -> np.ndarray:
        """(N,) bool: at least half a spacing from the borders of the image, where dots are seen."""
        return ((uv > self.spacing / 2) & (uv < self._size - self.spacing / 2)).all(axis=1)

    def _surprise(self, place) -> float:
        """Nats, of the motion of the tracks to positions (M, 2) px, by the prediction that it fits best."""
        return min(cost + np.median(((place - expected)[self.seen]**2).sum(axis=1)) / (2 * (_MOTION * self.spacing)**2)
                   for expected, cost in self._expected)


def _filled(offset, near) -> np.ndarray:
    """Offsets (M, 2), where they are NaN the mean of those of the neighbours near (M, K), else the median of all, else 0."""
    known = np.isfinite(offset[:, 0])
    if known.all():
        return offset
    count = known[near].sum(axis=1)[:, None]
    mean = np.where(known[near][..., None], offset[near], 0).sum(axis=1) / np.maximum(count, 1)
    common = np.median(offset[known], axis=0) if known.any() else np.zeros(2)
    return np.where(known[:, None], offset, np.where(count > 0, mean, common))
