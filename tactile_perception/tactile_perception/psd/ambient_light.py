# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Detection of approach and contact from the total light, with rejection of steps in ambient light."""
from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

# Chosen, in standard deviations of the untouched total: thresholds of an object. The tests fail with _ON of 2.5 and 10, and pass with _OFF
# of 1.5 to 6.
_ON, _OFF = 5.0, 3.0
_RISEN = 3.0  # standard deviations by which light must have risen before an onset. Chosen: the tests fail at 1.5 and pass at 6
_BEFORE_S, _BEFORE = 0.002, 4  # s, and samples at least, in which that rise is looked for. Chosen
_JUDGE_S, _JUDGE = 0.02, 6  # s, and samples at least, that a sudden onset is watched. Derived: two periods of lamps on 50 Hz mains
_GROWS, _GROWS_BY = 5.0, 0.1  # standard deviations, and part of the light, of a growth that ambient light does not show. Chosen
_FLAT = 0.02  # part of the light that ambient light may change by between the halves of that time. Chosen
_UNDECIDED, _NOTHING, _AMBIENT, _OBJECT = 'undecided', 'nothing', 'ambient', 'object'


@lru_cache(maxsize=64)
def filled(count: int, kind: type, value) -> np.ndarray:
    """A read-only array (count,) of one value, shared by all who ask for the same one: batches have a few sizes."""
    made = np.full(count, value, kind)
    made.setflags(write=False)
    return made


def hysteresis(on: np.ndarray, off: np.ndarray, before: bool) -> np.ndarray:
    """State (N,) bool of each sample: set by on (N,), cleared by off (N,), else unchanged; before: the state before the first."""
    if not on.any():
        return np.cumsum(off) == 0 if before else np.zeros(len(on), bool)
    if on.all():
        return on
    index = np.maximum.accumulate(np.where(on | off, np.arange(len(on)), -1))
    return np.where(index >= 0, on[index], before)


class Light(NamedTuple):
    """Samples as the detectors see them, V. total, over: (N,), the total, and what it is above the light at first contact; lowest, highest:
    of the totals; least_over: of over."""

    total: np.ndarray
    over: np.ndarray
    lowest: float
    highest: float
    least_over: float


class LightState(NamedTuple):
    """State of the first M samples of a batch. near: (M,) bool, an object is near; settled: (M,) bool, of a near object or of none, not of
    light that is still watched; None where all are; ambient_step: the last samples hold a step of ambient light, which the caller subtracts
    before it passes the remaining ones (only then is M below the batch's size)."""

    near: np.ndarray
    settled: np.ndarray | None
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
        self.near = False
        self.interrupt()

    def interrupt(self) -> None:
        """Samples are missing: what was before them does not show whether light rises."""
        self._before: list[np.ndarray] = []
        self._watched: list[float] | None = None

    def process(self, total: np.ndarray, lowest: float, highest: float, sigma: float, period_s: float) -> LightState:
        """State for totals (N,), V, from lowest to highest, of samples period_s apart; sigma: V, standard deviation of the untouched
        total."""
        self._most = max(math.ceil(_BEFORE_S / period_s), _BEFORE)
        if self._watched is None and (lowest >= _OFF * sigma if self.near else highest <= _ON * sigma):  # nothing changes
            self._keep(total)
            return LightState(filled(len(total), bool, self.near), None, False)
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
                return self._finished(total[:end], near[:end], (near | ~watched)[:end], True)
            if verdict == _OBJECT:
                near[end - 1:] = hysteresis(on[end - 1:], off[end - 1:], True)
            place = end
        return self._finished(total, near, near | ~watched, False)

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
        known = np.concatenate([*self._before, before])[-self._most:]
        if len(known) < _BEFORE:
            return True
        return known[-1] > _RISEN * sigma or known.mean() > _RISEN * sigma / math.sqrt(len(known))

    def _stays(self, sigma: float) -> bool:
        half = len(self._watched) // 2
        first, second = (float(np.mean(part)) for part in (self._watched[:half], self._watched[half:]))
        return abs(second - first) < _RISEN * sigma * math.sqrt(2 / half) + _FLAT * second

    def _finished(self, total: np.ndarray, near: np.ndarray, settled: np.ndarray, ambient_step: bool) -> LightState:
        self.near = bool(near[-1])
        if ambient_step:
            self._before.clear()
        else:
            self._keep(total)
        return LightState(near, settled, ambient_step)

    def _keep(self, total: np.ndarray) -> None:
        """Totals (N,) that the next ones are compared with; as many batches as samples are needed are enough."""
        self._before.append(total)
        del self._before[:-self._most]


_HALF = 1.5  # standard deviations of the untouched total: half the hysteresis. Chosen


class ContactDetector:
    """Contact detection with hysteresis; touching: whether the last sample was in contact."""

    def __init__(self):
        self._proximity = ProximityDetector()
        self.begin()

    def begin(self) -> None:
        """Nothing touches."""
        self.touching, self._seen = False, False
        self._proximity.begin()

    def interrupt(self) -> None:
        """Samples are missing: a contact goes on only if the next sample shows one by itself."""
        self._seen = False
        self._proximity.interrupt()

    def process(self, light: Light, sigma: float, period_s: float) -> tuple[np.ndarray, LightState]:
        """(contact (M,) bool, LightState) for samples period_s apart; sigma: V, of the untouched total."""
        state = self._proximity.process(light.total, light.lowest, light.highest, sigma, period_s)
        contact, goes_on, self._seen = state.near, self.touching and self._seen, True
        if goes_on and light.lowest >= _OFF * sigma and light.least_over >= -_HALF * sigma:  # the contact continues
            return contact, state
        if light.highest > _OFF * sigma and contact.any():
            over = light.over[:len(contact)]
            contact = contact & hysteresis((over > _HALF * sigma) & contact, (over < -_HALF * sigma) | ~contact, goes_on)
        self.touching = bool(contact[-1])
        return contact, state
