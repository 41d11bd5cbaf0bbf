# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Ambient light, told from light that an object brings: sample by sample from the total, lamps switched while an object touches by their
step from one sample to the next, and contact or none by both."""
from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from .geometry import TOTAL

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


_AROUND = 8  # samples before and after, which have to lie on one slope but for the step
_LEAST = 6.5  # standard deviations of the total
_JUMP = 4.5  # standard deviations from sample to sample that are looked at
_AT_ONCE = 3.5  # standard deviations by which the jump from sample to sample may differ from the step
_SMOOTH, _SMOOTH_PART = 1.6, 0.05  # what they may scatter by around it: standard deviations, and part of the step
_SLOWEST_S = 0.002  # between samples: what touches can move between two that are farther apart
_BASIS = np.column_stack([np.ones(2 * _AROUND), np.linspace(-1, 1, 2 * _AROUND), np.arange(2 * _AROUND) >= _AROUND])
_FIT = np.linalg.pinv(_BASIS)


class StepWatch:
    """Follows samples in portions."""

    def __init__(self):
        self.begin()

    def begin(self) -> None:
        """No samples are known."""
        self._parts: list[np.ndarray] = []
        self._known = self._open = 0  # samples in parts; samples to come until the last jump is judged
        self._last: float | None = None  # total

    def find(self, sums: np.ndarray, floor: float, sigma: float, period_s: float) -> tuple[int, np.ndarray] | None:
        """(samples up to where it is certain, change (4,) of the sums) of the first step in sums (N, 4) = voltages @ MIX over one and
        the same offset; None where there is none.

        floor: V, total above which an object is there; sigma: V, of the untouched total. Samples are remembered for the next call, up to
        the step where there is one.
        """
        if period_s > _SLOWEST_S:
            return None
        total = sums[:, TOTAL]
        jump = 0.0 if self._last is None else abs(total[0] - self._last)
        if len(total) > 1:
            jump = max(jump, np.abs(total[1:] - total[:-1]).max())
        self._last = total[-1]
        self._parts.append(sums)
        self._known += len(sums)
        found = None
        if jump > _JUMP * sigma or self._open > 0:
            found = self._judge(len(sums), floor, sigma)
        if self._known > 8 * _AROUND:
            self._parts = [np.concatenate(self._parts)[-2 * _AROUND:]]
            self._known = len(self._parts[0])
        return found

    def _judge(self, new: int, floor: float, sigma: float) -> tuple[int, np.ndarray] | None:
        """As find, with the jumps in what is known; new: samples that have just come."""
        known = np.concatenate(self._parts)
        begun = len(known) - new
        jumps = np.diff(known[:, TOTAL])
        places = np.flatnonzero(np.abs(jumps) > _JUMP * sigma) + 1
        self._open = max([place + _AROUND - len(known) for place in places.tolist()], default=0)
        for place in places.tolist():
            end = place + _AROUND
            if place < _AROUND or end > len(known) or end <= begun or known[place - 1, TOTAL] < floor:
                continue
            change = _change(known[place - _AROUND:end], jumps[place - 1], sigma)
            if change is not None:
                self.begin()
                return end - begun, change
        return None


def _change(around: np.ndarray, jump: float, sigma: float) -> np.ndarray | None:
    """(4,) the change amid samples (16, 4), where it is a step whether or not they are on a slope; else None."""
    change = around[_AROUND:].mean(0) - around[:_AROUND].mean(0)
    sloped = _FIT @ around[:, TOTAL]
    if any(abs(step) < _LEAST * sigma or abs(jump - step) > _AT_ONCE * sigma for step in (change[TOTAL], sloped[2])):
        return None
    scatter = np.std(around[:, TOTAL] - _BASIS @ sloped)
    return None if scatter > _SMOOTH * sigma + _SMOOTH_PART * abs(sloped[2]) else change


_LEAST_LEVEL, _HALF = 4.0, 1.5  # standard deviations: of the light at touch at the least; hysteresis to either side


class TouchDecision:
    """Contact with hysteresis; touching: whether the last sample was in contact."""

    def __init__(self):
        self._lamps = LampWatch()
        self.begin()

    def begin(self) -> None:
        """Nothing touches."""
        self.touching = False
        self._lamps.begin()

    def process(self, total: np.ndarray, level: np.ndarray | None, sigma: float, period_s: float) -> tuple[np.ndarray, Seen]:
        """(contact (M,), what was seen) for totals (N,), V, of samples period_s apart.

        level: (N,) V at which the waveguide is touched where the light is; None where not known: then whatever is near touches.
        """
        seen = self._lamps.process(total, sigma, period_s)
        contact = seen.near
        if level is not None and contact.any():
            over = total[:len(contact)] - np.maximum(level[:len(contact)], _LEAST_LEVEL * sigma)
            if not (self.touching and over.min() >= -_HALF * sigma and contact.all()):  # else it goes on
                contact = contact & held((over > _HALF * sigma) & contact, (over < -_HALF * sigma) | ~contact, self.touching)
        self.touching = bool(contact[-1])
        return contact, seen
