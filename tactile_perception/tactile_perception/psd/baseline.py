# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The untouched state: offset and noise of the outputs, measured and tracked."""
from __future__ import annotations

import math
from collections import deque

import numpy as np

from ..errors import BadArgument
from .drift import DriftFilter
from .geometry import MIX, TOTAL, X, Y

_SLOW_S = 0.1  # s of the fastest drift that are no object. Chosen: 10 mV of 0.1 V/s
_UNSEEN_S = 0.5  # s, longest time for which drift goes on under a contact. Chosen: a lasting one tells nothing of it
_BEFORE = 3  # updates before a contact that may hold the object's shade. Chosen: 60 ms, in which it comes near
_SHADE = 0.15  # part of the light that an object shades at most. Chosen
_EVIDENT = 3.0  # standard deviations of the offsets' sum, from which it has become darker. Chosen
_FAST_S = 0.02  # s, time constant of falling light, which no contact causes. Chosen: one update
_NOISE_S = 5.0  # s, time constant of the noise. Chosen
_STEP_S = 0.02  # s, between updates. Chosen: two periods of lamps on 50 Hz mains
_FLAT_S = 0.5  # s: light that is constant for so long, without contact, is ambient. Chosen
_QUIET = 3.0  # standard deviations of the total within which nothing is near. Chosen
_MIN_SIGMA = 1e-4  # V, floor of the total's standard deviation: keeps thresholds positive for noiseless input


class Reference:
    """Offset and noise of the untouched outputs, measured over some seconds and tracked while nothing touches.

    offset: (4,) V; uncertainty, uncertainty_across: V, standard deviation of a sum of the offsets, along the room's light and across it;
    noise: (4, 4) covariance of the sums, V^2; sigma: V, standard deviation of the total at rest; fastest: V/s, fastest drift of the total;
    what rises faster is an approaching object. Raises BadArgument for seconds or fastest that are not positive.
    """

    def __init__(self, seconds: float, fastest: float):
        if not (seconds > 0 and fastest > 0):
            raise BadArgument(f'reference: {seconds} s and {fastest} V/s must be positive')
        self._seconds, self._fastest = seconds, fastest
        self._take_noise(np.zeros((4, 4)))
        self._use(DriftFilter(np.zeros(4), 0.0, fastest / 4))
        self.begin()

    def begin(self) -> None:
        """Measure it anew from the next samples."""
        self._taken: list[np.ndarray] = []
        self._ahead_s, self._have_s, self._flat_s, self._flat_at, self._unseen_s = 0.0, 0.0, 0.0, 0.0, 0.0
        self._sums, self._squares, self._count = np.zeros(4), np.zeros((4, 4)), 0
        self.ready = False

    def _use(self, drift: DriftFilter) -> None:
        self._drift, self.offset = drift, drift.offset
        self.uncertainty, self.uncertainty_across = (2 * math.sqrt(variance) for variance in drift.variances)

    def _take_noise(self, noise: np.ndarray) -> None:
        self.noise, self.sigma = noise, math.sqrt(noise.item(TOTAL, TOTAL))

    def take(self, volts: np.ndarray, period_s: float) -> int:
        """Measure with the first of finite samples (N, 4); returns how many it used."""
        missing = max(int(np.ceil((self._seconds - self._have_s) / period_s - 1e-9)), 1)
        used = volts[:missing]
        self._taken.append(used)
        self._have_s += len(used) * period_s
        if len(used) == missing and sum(map(len, self._taken)) >= 5:
            self._settle(np.concatenate(self._taken))
        return len(used)

    def _settle(self, volts: np.ndarray) -> None:
        """Average. Where the total varies beyond its noise, only the darker half, so that a contact at the start does less harm."""
        total = volts.sum(1)
        chosen = volts[total <= np.median(total)] if np.std(total) > 4 * _difference_noise(total) else volts
        offset = chosen.mean(0)
        sums = (chosen - offset) @ MIX
        self._take_noise(sums.T @ sums / max(len(sums) - 1, 1) + _MIN_SIGMA**2 * np.eye(4))
        self._taken, self.ready = [], True
        self._use(DriftFilter(offset, self.sigma**2 / (4 * len(sums)), self._fastest / 4))
        self._earlier: deque[tuple] = deque([(0.0, self._drift.state)], _BEFORE)

    def follow(self, sums: np.ndarray, period_s: float) -> None:
        """Track with untouched samples: sums (N, 4) relative to the present offset."""
        self._sums += sums.sum(0)
        self._squares += sums.T @ sums
        self._count += len(sums)
        if self._count * period_s >= _STEP_S:
            mean, square, count = self._sums / self._count, self._squares / self._count, self._count
            self._sums, self._squares, self._count = np.zeros(4), np.zeros((4, 4)), 0
            self._update(mean, square, count, count * period_s)

    def hold(self, seconds: float) -> None:
        """Something touches for so many seconds: the offset stays, and may have drifted when it is seen again."""
        if self._unseen_s < _UNSEEN_S:
            self._unseen_s, self._ahead_s = self._unseen_s + seconds, self._ahead_s + seconds
            if self._ahead_s >= _STEP_S:
                self._drift.predict(self._ahead_s)
                self._ahead_s = 0.0
                self._use(self._drift)

    def recall(self) -> None:
        """A contact begins: return to the offset before the object came near, if it has shaded an evident part of the ambient light since.
        Else the latest offset is the best known."""
        self._sums, self._squares, self._count = np.zeros(4), np.zeros((4, 4)), 0
        before, now = self._earlier[0][1], self.offset
        was = self._drift.offset_in(before[0]).sum()
        if was * (1 - _SHADE) < now.sum() < was - _EVIDENT * self.uncertainty:
            self._drift.recall(before, sum(seconds for seconds, _ in list(self._earlier)[1:]))
            self._use(self._drift)

    def _update(self, mean: np.ndarray, square: np.ndarray, count: int, seconds: float) -> None:
        scatter = self.sigma / math.sqrt(count)
        change, slack = MIX @ mean / 4, self._fastest * (_SLOW_S + self._unseen_s)
        if mean[TOTAL] < -_QUIET * scatter - self._fastest * seconds:
            self._drift.move(change * (1 - math.exp(-seconds / _FAST_S)))
            self._drift.restart(scatter**2 / 4)
        elif mean[TOTAL] > _QUIET * scatter + slack:
            self._update_brighter(change, mean[TOTAL], scatter, seconds)
        else:
            self._flat_s = 0.0
            self._drift.correct(change, (self.noise[X, X] + self.noise[Y, Y]) / (8 * count), seconds)
            self._unseen_s = 0.0
            part = 1 - math.exp(-seconds / _NOISE_S)
            self._take_noise((1 - part) * self.noise + part * (square + _MIN_SIGMA**2 * np.eye(4)))
        self._use(self._drift)
        self._earlier.append((seconds, self._drift.state))

    def _update_brighter(self, change: np.ndarray, total: float, scatter: float, seconds: float) -> None:
        """Brighter than untouched without contact: an approaching object, or ambient light if it stays constant. Until that is decided the
        offset follows at the fastest drift."""
        if abs(total - self._flat_at) > _QUIET * scatter + 2 * self._fastest * self._flat_s:
            self._flat_s, self._flat_at = 0.0, total
        self._flat_s += seconds
        part = 1.0 if self._flat_s >= _FLAT_S else min(self._fastest * seconds / total, 1.0)
        self._flat_s *= self._flat_s < _FLAT_S
        self._drift.move(part * change)
        if part == 1:
            self._drift.restart(scatter**2 / 4)

    def shift(self, change: np.ndarray) -> None:
        """Apply a step of ambient light: change (4,) V."""
        self._drift.move(change)
        self._use(self._drift)
        self._earlier = deque([(seconds, (state[0] + change, state[1])) for seconds, state in self._earlier], _BEFORE)


def _difference_noise(total: np.ndarray) -> float:
    """Standard deviation, V, from sample to sample (slow changes cancel)."""
    return float(np.std(np.diff(total)) / np.sqrt(2)) + 1e-12
