# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Growth of the resources of processes: one slope over all lives of a process that was restarted repeatedly."""
from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

_FLAT = {'memory': 1.0, 'fds': 1.0}  # MB and file descriptors over the whole run; less is not growth. Chosen
_SURE = 2.0  # standard errors of a significant slope. Chosen
_HOUR = 3600.0


class Sample(NamedTuple):
    """What a process took at a time: s since the begin; its number; MB of memory of no file; file descriptors; threads."""

    seconds: float
    pid: int
    memory: float
    fds: int
    threads: int


def settled(samples: Sequence[Sample], settle: float) -> list[Sample]:
    """The samples but those of the first s of each life: imports, discovery, buffers that are filled for the first time."""
    born: dict[int, float] = {}
    return [sample for sample in samples if sample.seconds - born.setdefault(sample.pid, sample.seconds) >= settle]


def slope(samples: Sequence[Sample], key: str) -> tuple[float, float]:
    """(slope, standard error), an hour, of memory or fds: least squares with one slope, and an offset for each life; NaN where there are
    too few samples to tell. The error takes the samples as independent: where they are not, it is too small, and growth is seen too soon.
    """
    values, seconds = (np.array([getattr(sample, name) for sample in samples], float) for name in (key, 'seconds'))
    lives = np.array([s.pid for s in samples])
    for pid in set(lives.tolist()):
        own = lives == pid
        values[own], seconds[own] = values[own] - values[own].mean(), seconds[own] - seconds[own].mean()
    freedom, spread = len(samples) - len(set(lives.tolist())) - 1, float(seconds @ seconds)
    if freedom < 1 or spread == 0:
        return math.nan, math.nan
    found = float(seconds @ values) / spread
    rest = values - found * seconds
    return found * _HOUR, math.sqrt(float(rest @ rest) / freedom / spread) * _HOUR


def flat(found: tuple[float, float], key: str, duration: float) -> bool:
    """Whether a slope is none: within two standard errors of 0, less than 1 MB or descriptor in so many s, or below 0."""
    per_hour, error = found
    return per_hour <= _SURE * error or per_hour * duration / _HOUR < _FLAT[key]


def trend(samples: Sequence[Sample], duration: float, settle: float) -> dict:
    """Of one process: its lives, first and last of memory and descriptors, their slopes, and whether they are flat."""
    counted = settled(samples, settle)
    result: dict = {'lives': len({s.pid for s in samples}), 'samples': len(counted), 'threads': max(s.threads for s in samples)}
    for key in _FLAT:
        found = slope(counted, key)
        ends = [getattr(counted[k], key) for k in (0, -1)] if counted else [math.nan] * 2
        result[key] = {'first': ends[0], 'last': ends[1], 'an hour': found[0], 'error': found[1], 'flat': flat(found, key, duration)}
    return result
