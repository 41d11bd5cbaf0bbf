# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tells a lamp that is switched while an object touches: all of the change comes from one sample to the next, and nothing moves then."""
from __future__ import annotations

import numpy as np

from .signals import TOTAL

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
