# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The untouched state: what the outputs are without contact, how they scatter, and how both are followed."""
from __future__ import annotations

import math

import numpy as np

from ..errors import BadArgument
from .geometry import MIX, TOTAL

_SLOW_S = 0.5  # drift is followed with this time constant
_FAST_S = 0.02  # light that is taken away: no contact makes it darker than nothing does
_NOISE_S = 5.0
_STEP_S = 0.02  # samples at rest are gathered for so long, and then used
_FLAT_S = 0.5  # light that stays the same for so long, under what a contact makes, is no object on its way
_QUIET = 3.0  # standard deviations of the total within which nothing is near
_LEAST = 1e-4  # V: what an untouched total scatters by at the least


class Reference:
    """Offset and noise, taken over seconds at the start or when asked for, followed at rest.

    offset: (4,) V; noise: (4, 4) covariance of the sums, V^2; fastest: V/s, drift of the total that is followed; what rises faster is an
    object that comes near.
    """

    def __init__(self, seconds: float, fastest: float):
        if not (seconds > 0 and fastest > 0):
            raise BadArgument(f'reference: {seconds} s and {fastest} V/s must be positive')
        self._seconds, self._fastest = seconds, fastest
        self.offset, self.noise = np.zeros(4), np.zeros((4, 4))
        self.begin()

    def begin(self) -> None:
        """Take it anew from the next samples."""
        self._taken: list[np.ndarray] = []
        self._have_s, self._flat_s, self._flat_at = 0.0, 0.0, 0.0
        self._sums, self._squares, self._count = np.zeros(4), np.zeros((4, 4)), 0
        self.ready = False

    @property
    def sigma(self) -> float:
        """Standard deviation of the total at rest, V."""
        return math.sqrt(self.noise[TOTAL, TOTAL])

    def take(self, volts: np.ndarray, period_s: float) -> int:
        """Use the first of finite samples (N, 4) for the reference; how many it took."""
        missing = max(int(np.ceil((self._seconds - self._have_s) / period_s - 1e-9)), 1)
        used = volts[:missing]
        self._taken.append(used)
        self._have_s += len(used) * period_s
        if len(used) == missing and sum(map(len, self._taken)) >= 5:
            self._settle(np.concatenate(self._taken))
        return len(used)

    def _settle(self, volts: np.ndarray) -> None:
        """The quieter half decides, so that a touch at the start does less harm."""
        total = volts.sum(1)
        chosen = volts[total <= np.median(total)] if np.std(total) > 4 * _difference_noise(total) else volts
        self.offset = chosen.mean(0)
        sums = (chosen - self.offset) @ MIX
        self.noise = sums.T @ sums / max(len(sums) - 1, 1) + _LEAST**2 * np.eye(4)
        self._taken, self.ready = [], True

    def follow(self, sums: np.ndarray, period_s: float) -> None:
        """Take note of samples at rest: sums (N, 4) over the present offset."""
        self._sums += sums.sum(0)
        self._squares += sums.T @ sums
        self._count += len(sums)
        if self._count * period_s >= _STEP_S:
            mean, square, count = self._sums / self._count, self._squares / self._count, self._count
            self._sums, self._squares, self._count = np.zeros(4), np.zeros((4, 4)), 0
            self._use(mean, square, count, count * period_s)

    def _use(self, mean: np.ndarray, square: np.ndarray, count: int, seconds: float) -> None:
        scatter = self.sigma / math.sqrt(count)
        change = MIX @ mean / 4
        if mean[TOTAL] < -_QUIET * scatter - self._fastest * seconds:
            self.offset = self.offset + change * (1 - math.exp(-seconds / _FAST_S))
        elif mean[TOTAL] > _QUIET * scatter + self._fastest * _SLOW_S:
            self._wait(change, mean[TOTAL], scatter, seconds)
        else:
            self._flat_s = 0.0
            self.offset = self.offset + change * (1 - math.exp(-seconds / _SLOW_S))
            part = 1 - math.exp(-seconds / _NOISE_S)
            self.noise = (1 - part) * self.noise + part * (square + _LEAST**2 * np.eye(4))

    def _wait(self, change: np.ndarray, total: float, scatter: float, seconds: float) -> None:
        """Brighter than untouched, without a contact: an object that comes near, or other light if it stays as it is. As fast as drift
        may be, it is followed all the same."""
        if abs(total - self._flat_at) > _QUIET * scatter + 2 * self._fastest * self._flat_s:
            self._flat_s, self._flat_at = 0.0, total
        self._flat_s += seconds
        part = 1.0 if self._flat_s >= _FLAT_S else min(self._fastest * seconds / total, 1.0)
        self._flat_s *= self._flat_s < _FLAT_S
        self.offset = self.offset + part * change

    def shift(self, change: np.ndarray) -> None:
        """Light that has come or gone at once: change (4,) V."""
        self.offset = self.offset + change


def _difference_noise(total: np.ndarray) -> float:
    """Standard deviation of what is left when what lasts is taken off, V."""
    return float(np.std(np.diff(total)) / np.sqrt(2)) + 1e-12
