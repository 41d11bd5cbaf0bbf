# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The untouched state: offset and noise of the outputs, measured and tracked."""
from __future__ import annotations

import copy
import math

import numpy as np

from ..errors import BadArgument
from .drift import DriftFilter
from .geometry import MIX, TOTAL, X, Y

_SLOW_S = 0.1  # s of the fastest drift that are no object. Chosen: 10 mV of 0.1 V/s
_UNSEEN_S = 0.5  # s, longest time for which drift goes on under a contact. Chosen: a lasting one tells nothing of it
_FAST_S = 0.02  # s, time constant of falling light, which no contact causes. Chosen: one update
_NOISE_S = 5.0  # s, time constant of the noise. Chosen
_STEP_S = 0.02  # s, between updates. Chosen: two periods of lamps on 50 Hz mains
_FLAT_S = 0.2  # s: light that is constant for so long, without contact, is ambient. Chosen: twice _SLOW_S
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
        self._leaves = False
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
        self._before = self._drift  # without the last update; the same in contact

    def follow(self, sums: np.ndarray, period_s: float) -> None:
        """Track with untouched samples: sums (N, 4) relative to the present offset."""
        whole, at = math.ceil(_STEP_S / period_s - 1e-9), self.offset
        while len(sums):
            part, sums = sums[:whole - self._count], sums[whole - self._count:]
            part = part + (at - self.offset) @ MIX
            self._sums += part.sum(0)
            self._squares += part.T @ part
            self._count += len(part)
            if self._count >= whole:
                mean, square, count = self._sums / self._count, self._squares / self._count, self._count
                self._sums, self._squares, self._count = np.zeros(4), np.zeros((4, 4)), 0
                self._update(mean, square, count, count * period_s)

    def hold(self, seconds: float) -> None:
        """Something touches for so many seconds: the offset stays, and may have drifted when it is seen again."""
        self._leaves = True
        if self._unseen_s < _UNSEEN_S:
            self._unseen_s, self._ahead_s = self._unseen_s + seconds, self._ahead_s + seconds
            if self._ahead_s >= _STEP_S:
                self._drift.predict(self._ahead_s)
                self._ahead_s = 0.0
                self._use(self._drift)

    def recall(self) -> None:
        """A contact begins: return to the offset before the last update, which may hold light of the object that comes near."""
        self._sums, self._squares, self._count = np.zeros(4), np.zeros((4, 4)), 0
        self._use(self._before)

    def _update(self, mean: np.ndarray, square: np.ndarray, count: int, seconds: float) -> None:
        scatter, change = self.sigma / math.sqrt(count), MIX @ mean / 4
        leaves, self._leaves = self._leaves, False
        self._before = copy.copy(self._drift)
        self._before.predict(seconds)
        if mean[TOTAL] < -_QUIET * scatter - self._fastest * seconds:
            self._step(change * (1 - math.exp(-seconds / _FAST_S)), scatter)
        elif mean[TOTAL] > _QUIET * scatter + self._fastest * (_SLOW_S + self._unseen_s):
            if self._stays(mean[TOTAL], scatter, seconds):
                self._step(change, scatter)
            elif not leaves:
                self._drift.move(change * min(self._fastest * seconds / mean[TOTAL], 1.0))
        elif leaves:  # the object that touched may still be near
            self._drift.predict(seconds)
        else:
            self._correct(change, square, count, seconds)
        self._use(self._drift)

    def _correct(self, change: np.ndarray, square: np.ndarray, count: int, seconds: float) -> None:
        """Untouched samples by change (4,) V above the offset, with mean square (4, 4) V^2 of their sums."""
        self._flat_s = self._unseen_s = 0.0
        self._drift.correct(change, (self.noise[X, X] + self.noise[Y, Y]) / (8 * count), seconds)
        part = 1 - math.exp(-seconds / _NOISE_S)
        self._take_noise((1 - part) * self.noise + part * (square + _MIN_SIGMA**2 * np.eye(4)))

    def _step(self, change: np.ndarray, scatter: float) -> None:
        """Light of the room that has changed, by change (4,) V, as no object does it."""
        self._drift.move(change)
        self._drift.restart(scatter**2 / 4)
        self._before = self._drift

    def _stays(self, total: float, scatter: float, seconds: float) -> bool:
        """Whether light, V, without contact has been constant for so long that it is the room's; until then it may be an approaching
        object's, and the offset follows at the fastest drift."""
        if abs(total - self._flat_at) > _QUIET * scatter + 2 * self._fastest * self._flat_s:
            self._flat_s, self._flat_at = 0.0, total
        self._flat_s += seconds
        stays = self._flat_s >= _FLAT_S
        self._flat_s *= not stays
        return stays

    def shift(self, change: np.ndarray) -> None:
        """Apply a step of ambient light: change (4,) V."""
        for drift in {self._drift, self._before}:
            drift.move(change)
        self._use(self._drift)


def _difference_noise(total: np.ndarray) -> float:
    """Standard deviation, V, from sample to sample (slow changes cancel)."""
    return float(np.std(np.diff(total)) / np.sqrt(2)) + 1e-12
