# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tells light that an object brings from light that is switched on, sample by sample, from the total."""
from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

_ON, _OFF = 5.0, 3.0  # standard deviations of the untouched total
_NEAR = 3.0  # standard deviations: something was near before
_BEFORE_S, _BEFORE = 0.002, 4  # how long before light comes it is looked whether it rose, s, and samples at least
_JUDGE_S, _JUDGE = 0.02, 6  # how long light that came at once is watched: two periods of lamps at 100 Hz
_GROWS, _GROWS_BY = 5.0, 0.1  # standard deviations, and part of the light, by which it is no lamp's at once
_FLAT = 0.02  # of the light, by which lamps may differ from one half of that time to the other
_UNDECIDED, _NOTHING, _LAMP, _OBJECT = 'undecided', 'nothing', 'lamp', 'object'


def held(on: np.ndarray, off: np.ndarray, before: bool) -> np.ndarray:
    """(N,) bool: the state of each sample, switched by on and off, else as before."""
    if not on.any():
        return np.cumsum(off) == 0 if before else np.zeros(len(on), bool)
    if on.all():
        return on
    index = np.maximum.accumulate(np.where(on | off, np.arange(len(on)), -1))
    return np.where(index >= 0, on[index], before)


class Seen(NamedTuple):
    """What the first samples (M,) of some are. near: an object is; rest: nothing is, so that they tell the untouched state; lamp: the
    last ones are in a lamp's light, which has to be taken off before the others are judged: only then is M less than all."""

    near: np.ndarray
    rest: np.ndarray
    lamp: bool


class LampWatch:
    """Follows whether an object is near.

    Before the waveguide is touched the light rises by what the cover reflects. Light that is there from one sample to the next, with no
    such rise, is watched for up to 20 ms: if it grows it is an object's at once, if it stays the same it is a lamp's.
    """

    def __init__(self):
        self.begin()

    def begin(self) -> None:
        """Nothing is near."""
        self.near, self._period_s = False, 0.0
        self._before: deque[float] = deque(maxlen=_BEFORE)
        self._watched: list[float] | None = None

    def process(self, total: np.ndarray, sigma: float, period_s: float) -> Seen:
        """What totals (N,), V, of samples period_s apart are; sigma: V, of the untouched total."""
        if period_s != self._period_s:
            self._before, self._period_s = deque(self._before, max(math.ceil(_BEFORE_S / period_s), _BEFORE)), period_s
        lowest, highest = float(total.min()), float(total.max())
        if self._watched is None and (lowest >= _OFF * sigma if self.near else highest <= _ON * sigma):  # nothing changes
            near = np.full(len(total), self.near)
            return self._finished(total, near, ~near, False)
        on, off = total > _ON * sigma, total < _OFF * sigma
        near = held(on, off, self.near)
        return self._with_onsets(total, on, off, near, sigma, period_s)

    def _next_onset(self, near: np.ndarray, begin: int) -> int | None:
        before = self.near if begin == 0 else bool(near[begin - 1])
        rises = np.flatnonzero(near[begin:] & ~np.r_[before, near[begin:-1]])
        return begin + int(rises[0]) if len(rises) else None

    def _with_onsets(self, total, on, off, near, sigma, period_s) -> Seen:
        place, watched = 0, np.zeros(len(total), bool)
        while place < len(total):
            if self._watched is None:
                onset = self._next_onset(near, place)
                if onset is None:
                    break
                if self._rises(total[:onset], sigma):
                    place = onset + 1
                    continue
                self._watched, place = [], onset
            end, verdict = self._watch(total[place:], off[place:], sigma, period_s)
            end += place
            near[place:end], watched[place:end] = False, True
            if verdict == _LAMP:
                return self._finished(total[:end], near[:end], ~(near | watched)[:end], True)
            if verdict == _OBJECT:
                near[end - 1:] = held(on[end - 1:], off[end - 1:], True)
            place = end
        return self._finished(total, near, ~(near | watched), False)

    def _watch(self, total: np.ndarray, off: np.ndarray, sigma: float, period_s: float) -> tuple[int, str]:
        """(samples that were looked at, what they are) of totals from where the watching began or goes on."""
        most = max(math.ceil(_JUDGE_S / period_s), _JUDGE)
        for number, (light, gone) in enumerate(zip(total.tolist(), off.tolist()), 1):
            self._watched.append(light)
            verdict = _UNDECIDED
            if gone:  # a spark
                verdict = _NOTHING
            elif light > (1 + _GROWS_BY) * self._watched[0] + _GROWS * sigma:
                verdict = _OBJECT
            elif len(self._watched) >= most:
                verdict = _LAMP if self._stays(sigma) else _OBJECT
            if verdict != _UNDECIDED:
                self._watched = None
                return number, verdict
        return len(total), _UNDECIDED

    def _rises(self, before: np.ndarray, sigma: float) -> bool:
        """Whether the light has risen before the onset."""
        known = np.r_[list(self._before), before[-self._before.maxlen:]][-self._before.maxlen:]
        if len(known) < _BEFORE:
            return True
        return known[-1] > _NEAR * sigma or known.mean() > _NEAR * sigma / math.sqrt(len(known))

    def _stays(self, sigma: float) -> bool:
        half = len(self._watched) // 2
        first, second = (float(np.mean(part)) for part in (self._watched[:half], self._watched[half:]))
        return abs(second - first) < _NEAR * sigma * math.sqrt(2 / half) + _FLAT * second

    def _finished(self, total: np.ndarray, near: np.ndarray, rest: np.ndarray, lamp: bool) -> Seen:
        self.near = bool(near[-1])
        self._before.extend(total[-self._before.maxlen:].tolist())
        if lamp:
            self._before.clear()
        return Seen(near, rest, lamp)
