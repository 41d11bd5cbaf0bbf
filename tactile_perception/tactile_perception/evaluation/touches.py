# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Matches estimated and true touches: missed and false touches, and the errors of the matched ones."""
from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import linear_sum_assignment

from ..common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, SATURATED, ContactEstimate
from ..finger.map import error_angle
from .scores import honest_range, normalised_square

FLAGS = {'OUT_OF_RANGE': OUT_OF_RANGE, 'AT_EDGE': AT_EDGE, 'AMBIGUOUS': AMBIGUOUS, 'SATURATED': SATURATED}


def pairs(told: list[ContactEstimate], true: list[ContactEstimate]) -> list[tuple[ContactEstimate, ContactEstimate]]:
    """Pairs (estimated, true) with the smallest sum of distances in x and y; as many as the shorter list holds."""
    if not told or not true:
        return []
    off = np.array([[np.hypot(*(t.position - r.position)[:2]) for r in true] for t in told])
    return [(told[a], true[b]) for a, b in zip(*linear_sum_assignment(np.nan_to_num(off)))]


def touch_errors(told: ContactEstimate, true: ContactEstimate) -> dict[str, float]:
    """Errors by quantity, SI units; quantities of unknown truth are left out; NaN for those without an estimate.

    The position error is measured in x and y; in 3D for a touch of unknown depth, because nothing else reports its error along z.
    """
    off = told.position - true.position
    errors = {'place': np.hypot(*off[:2]) if np.isfinite(told.depth) or not np.isfinite(off[2]) else np.linalg.norm(off),
              'depth': told.depth - true.depth, 'normal': float(error_angle(told.normal, true.normal)),
              'touch_force': told.force - true.force}
    known = {'place': true.position[:2], 'depth': true.depth, 'normal': true.normal, 'touch_force': true.force}
    return {name: float(error) for name, error in errors.items() if np.isfinite(known[name]).all()}


@dataclass
class _Episode:
    """One true touch from begin to end."""

    frames: int = 0
    told: int = 0
    begin: float = np.nan
    first_told: float = np.nan
    numbers: list[int] = field(default_factory=list)


@dataclass
class TouchCounts:
    """Counts of detected, missed and false touches, and the consistency of the covariances.

    frames: counts of frames judged, touched, missed (no touch estimated), too_few, too_many, untouched, false (a touch estimated without
    contact). An estimated touch is false if it was never matched to a true one.
    """

    frames: Counter = field(default_factory=Counter)
    flagged: Counter = field(default_factory=Counter)
    squares: list[tuple[float, int]] = field(default_factory=list)
    uncertain: int = 0
    _episodes: dict[int, _Episode] = field(default_factory=dict)
    _told: set[int] = field(default_factory=set)
    _matched: set[int] = field(default_factory=set)

    def add(self, stamp: float, told: list[ContactEstimate], true: list[ContactEstimate], matched: list) -> None:
        """Add one frame; matched: its pairs."""
        here = {'judged': True, 'touched': bool(true), 'untouched': not true, 'missed': bool(true) and not told,
                'too_few': 0 < len(told) < len(true), 'too_many': 0 < len(true) < len(told), 'false': bool(told) and not true}
        self.frames.update(name for name, so in here.items() if so)
        self._told.update(touch.id for touch in told)
        self._matched.update(touch.id for touch, _ in matched)
        for touch in true:
            episode = self._episodes.setdefault(touch.id, _Episode(begin=stamp))
            episode.frames += 1
        for touch, there in matched:
            self._match(self._episodes[there.id], stamp, touch, there)

    def _match(self, episode: _Episode, stamp: float, touch: ContactEstimate, there: ContactEstimate) -> None:
        if not episode.told:
            episode.first_told = stamp
        episode.told += 1
        if episode.numbers[-1:] != [touch.id]:
            episode.numbers.append(touch.id)
        self.flagged.update(name for name, flag in FLAGS.items() if touch.flags & flag)
        square, directions = normalised_square(touch.position - there.position, touch.position_covariance)
        if directions:
            self.squares.append((square, directions))
        elif np.isfinite(there.position).all():
            self.uncertain += 1

    def summary(self) -> dict:
        """Counts of frames, of touches and of flags, by name."""
        episodes = list(self._episodes.values())
        late = [e.first_told - e.begin for e in episodes if e.told]
        names = ('judged', 'touched', 'missed', 'too_few', 'too_many', 'untouched', 'false')
        return {'frames': {name: self.frames[name] for name in names},
                'touches': {'there': len(episodes), 'never_told': sum(not e.told for e in episodes),
                            'made_up': len(self._told - self._matched), 'renumbered': sum(max(len(e.numbers) - 1, 0) for e in episodes),
                            'told_after_ms': {'median': 1e3 * float(np.median(late)) if late else np.nan,
                                              'worst': 1e3 * float(np.max(late)) if late else np.nan}},
                'flagged': {name: self.flagged[name] for name in FLAGS}}

    def honesty(self) -> dict:
        """Normalised squared position errors per degree of freedom: mean (1 for consistent covariances), range of 95 % of them, that range
        for consistent covariances, and the share of touches within it. Only counts without stated covariances.
        """
        if not self.squares:
            return {'count': 0, 'not_stated': self.uncertain}
        values = np.array([square / directions for square, directions in self.squares])
        ranges = np.array([honest_range(directions) for _, directions in self.squares])
        return {'count': len(values), 'not_stated': self.uncertain, 'mean': float(values.mean()), 'median': float(np.median(values)),
                'range_95': np.percentile(values, [2.5, 97.5]).tolist(), 'honest_range_95': ranges.mean(axis=0).tolist(),
                'within_honest_range': float(((values >= ranges[:, 0]) & (values <= ranges[:, 1])).mean())}
