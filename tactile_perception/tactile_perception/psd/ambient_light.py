# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Detection of approach and contact from the total light, with rejection of steps in ambient light."""
from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from .geometry import TOTAL

# Chosen, in standard deviations of the untouched total: thresholds of an object. The tests fail with _ON of 2.5 and 10, and pass with _OFF
# of 1.5 to 6.
_ON, _OFF = 5.0, 3.0
_RISEN = 3.0  # standard deviations by which light must have risen before an onset. Chosen: the tests fail at 1.5 and pass at 6
_BEFORE_S, _BEFORE = 0.002, 4  # s, and samples at least, in which that rise is looked for. Chosen
_JUDGE_S, _JUDGE = 0.02, 6  # s, and samples at least, that a sudden onset is watched. Derived: two periods of lamps on 50 Hz mains
_GROWS, _GROWS_BY = 5.0, 0.1  # standard deviations, and part of the light, of a growth that ambient light does not show. Chosen
_FLAT = 0.02  # part of the light that ambient light may change by between the halves of that time. Chosen
_UNDECIDED, _NOTHING, _AMBIENT, _OBJECT = 'undecided', 'nothing', 'ambient', 'object'


def hysteresis(on: np.ndarray, off: np.ndarray, before: bool) -> np.ndarray:
    """State (N,) bool of each sample: set by on (N,), cleared by off (N,), else unchanged; before: the state before the first."""
    if not on.any():
        return np.cumsum(off) == 0 if before else np.zeros(len(on), bool)
    if on.all():
        return on
    index = np.maximum.accumulate(np.where(on | off, np.arange(len(on)), -1))
    return np.where(index >= 0, on[index], before)


class LightState(NamedTuple):
    """State of the first M samples of a batch. near: (M,) bool, an object is near; rest: (M,) bool, untouched; ambient_step: the last
    samples hold a step of ambient light, which the caller subtracts before it passes the remaining ones (only then is M below the batch's
    size)."""

    near: np.ndarray
    rest: np.ndarray
    ambient_step: bool


class ProximityDetector:
    """Detects whether an object is near.

    The cover reflects light before it touches the waveguide, so an object's light rises gradually (paper, section 6.3). A sudden onset is
    watched for up to 20 ms: light that grows is an object's, constant light is a step of ambient light.
    """

    def __init__(self):
        self.begin()

    def begin(self) -> None:
        """Nothing is near."""
        self.near, self._period_s = False, 0.0
        self._before: deque[float] = deque(maxlen=_BEFORE)
        self._watched: list[float] | None = None

    def process(self, total: np.ndarray, sigma: float, period_s: float) -> LightState:
        """State for totals (N,), V, of samples period_s apart; sigma: V, standard deviation of the untouched total."""
        if period_s != self._period_s:
            self._before, self._period_s = deque(self._before, max(math.ceil(_BEFORE_S / period_s), _BEFORE)), period_s
        lowest, highest = float(total.min()), float(total.max())
        if self._watched is None and (lowest >= _OFF * sigma if self.near else highest <= _ON * sigma):  # nothing changes
            near = np.full(len(total), self.near)
            return self._finished(total, near, ~near, False)
        on, off = total > _ON * sigma, total < _OFF * sigma
        near = hysteresis(on, off, self.near)
        return self._with_onsets(total, on, off, near, sigma, period_s)

    def _next_onset(self, near: np.ndarray, begin: int) -> int | None:
        before = self.near if begin == 0 else bool(near[begin - 1])
        rises = np.flatnonzero(near[begin:] & ~np.r_[before, near[begin:-1]])
        return begin + int(rises[0]) if len(rises) else None

    def _with_onsets(self, total, on, off, near, sigma, period_s) -> LightState:
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
            if verdict == _AMBIENT:
                return self._finished(total[:end], near[:end], ~(near | watched)[:end], True)
            if verdict == _OBJECT:
                near[end - 1:] = hysteresis(on[end - 1:], off[end - 1:], True)
            place = end
        return self._finished(total, near, ~(near | watched), False)

    def _watch(self, total: np.ndarray, off: np.ndarray, sigma: float, period_s: float) -> tuple[int, str]:
        """(samples used, verdict) for totals from the onset, or from where the last batch ended."""
        most = max(math.ceil(_JUDGE_S / period_s), _JUDGE)
        for number, (light, gone) in enumerate(zip(total.tolist(), off.tolist()), 1):
            self._watched.append(light)
            verdict = _UNDECIDED
            if gone:  # a single spike
                verdict = _NOTHING
            elif light > (1 + _GROWS_BY) * self._watched[0] + _GROWS * sigma:
                verdict = _OBJECT
            elif len(self._watched) >= most:
                verdict = _AMBIENT if self._stays(sigma) else _OBJECT
            if verdict != _UNDECIDED:
                self._watched = None
                return number, verdict
        return len(total), _UNDECIDED

    def _rises(self, before: np.ndarray, sigma: float) -> bool:
        """Whether the light has risen before the onset."""
        known = np.r_[list(self._before), before[-self._before.maxlen:]][-self._before.maxlen:]
        if len(known) < _BEFORE:
            return True
        return known[-1] > _RISEN * sigma or known.mean() > _RISEN * sigma / math.sqrt(len(known))

    def _stays(self, sigma: float) -> bool:
        half = len(self._watched) // 2
        first, second = (float(np.mean(part)) for part in (self._watched[:half], self._watched[half:]))
        return abs(second - first) < _RISEN * sigma * math.sqrt(2 / half) + _FLAT * second

    def _finished(self, total: np.ndarray, near: np.ndarray, rest: np.ndarray, ambient_step: bool) -> LightState:
        self.near = bool(near[-1])
        self._before.extend(total[-self._before.maxlen:].tolist())
        if ambient_step:
            self._before.clear()
        return LightState(near, rest, ambient_step)


# Thresholds of a step in ambient light during a contact; chosen, in standard deviations of the untouched total where no unit is given.
_AROUND = 8  # samples on either side, fitted by one slope and a step
_LEAST = 6.5  # smallest step
_JUMP = 4.5  # smallest difference of neighbouring samples that is examined
_AT_ONCE = 3.5  # largest deviation of that difference from the step
_SMOOTH, _SMOOTH_PART = 1.6, 0.05  # largest residual of the fit, and part of the step that is added to it
_SLOWEST_S = 0.002  # s, longest sample period; over longer ones an object can move as fast as a lamp is switched
_BASIS = np.column_stack([np.ones(2 * _AROUND), np.linspace(-1, 1, 2 * _AROUND), np.arange(2 * _AROUND) >= _AROUND])
_FIT = np.linalg.pinv(_BASIS)


class AmbientStepDetector:
    """Detects steps of ambient light while an object touches; the object's own light follows a slope, a lamp's does not."""

    def __init__(self):
        self.begin()

    def begin(self) -> None:
        """Forget all samples."""
        self._parts: list[np.ndarray] = []
        self._known = self._open = 0  # samples in parts; samples still missing after the last jump
        self._last: float | None = None  # total

    def find(self, sums: np.ndarray, floor: float, sigma: float, period_s: float) -> tuple[int, np.ndarray] | None:
        """The first step in sums (N, 4) = net voltages @ MIX: (samples until it is certain, change (4,) of the sums), or None.

        floor: V, total from which an object is there; sigma: V, standard deviation of the untouched total; period_s: s between samples.
        Samples are kept for the next call, up to the step if there is one. The offset must not change between calls.
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
        """See find; new: number of samples added by this call."""
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
    """Change (4,) in the middle of samples (16, 4) if it is a step with and without a slope fitted to them, else None."""
    change = around[_AROUND:].mean(0) - around[:_AROUND].mean(0)
    sloped = _FIT @ around[:, TOTAL]
    if any(abs(step) < _LEAST * sigma or abs(jump - step) > _AT_ONCE * sigma for step in (change[TOTAL], sloped[2])):
        return None
    scatter = np.std(around[:, TOTAL] - _BASIS @ sloped)
    return None if scatter > _SMOOTH * sigma + _SMOOTH_PART * abs(sloped[2]) else change


_LEAST_LEVEL, _HALF = 4.0, 1.5  # standard deviations of the untouched total: lowest threshold of contact; half the hysteresis. Chosen


class ContactDetector:
    """Contact detection with hysteresis; touching: whether the last sample was in contact."""

    def __init__(self):
        self._proximity = ProximityDetector()
        self.begin()

    def begin(self) -> None:
        """Nothing touches."""
        self.touching = False
        self._proximity.begin()

    def process(self, total: np.ndarray, level: np.ndarray | None, sigma: float, period_s: float) -> tuple[np.ndarray, LightState]:
        """(contact (M,) bool, LightState) for totals (N,), V, of samples period_s apart; sigma: V, of the untouched total.

        level: (N,) V, light at first contact at each sample's position; None where unknown: then all that is near is in contact.
        """
        state = self._proximity.process(total, sigma, period_s)
        contact = state.near
        if level is not None and contact.any():
            over = total[:len(contact)] - np.maximum(level[:len(contact)], _LEAST_LEVEL * sigma)
            if not (self.touching and over.min() >= -_HALF * sigma and contact.all()):  # else the contact continues
                contact = contact & hysteresis((over > _HALF * sigma) & contact, (over < -_HALF * sigma) | ~contact, self.touching)
        self.touching = bool(contact[-1])
        return contact, state
