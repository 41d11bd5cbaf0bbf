# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Measures how far apart two cameras without a trigger expose, and how this offset drifts."""
from __future__ import annotations

import math
from collections import deque

import numpy as np

_PAIRS = 150  # latest pairs that are measured: 5 s at 30 Hz; chosen
_FEWEST = 10  # pairs from which there is a result; chosen
_NS = 1e9


class ShutterOffset:
    """Offset of the right exposures from the left ones, from pairs of stamps.

    limit_ns: largest offset, ns, at which frames are paired; used for the warning.
    """

    def __init__(self, limit_ns: float = math.inf):
        self._limit = limit_ns
        self._pairs: deque[tuple[int, int]] = deque(maxlen=_PAIRS)  # left stamp and offset, ns

    def add(self, left_ns: int, right_ns: int, period_ns: float = math.inf) -> None:
        """Add the stamps, ns, of two nearest frames. A leap of half a period means that they pair in another way: measuring restarts."""
        offset = right_ns - left_ns
        if self._pairs and (abs(offset - self._pairs[-1][1]) > period_ns / 2 or left_ns <= self._pairs[-1][0]):
            self._pairs.clear()
        self._pairs.append((left_ns, offset))

    def numbers(self) -> dict[str, float]:
        """shutter offset (ms) of the last pair, positive where the right camera is later; and drift (ppm), by a straight line
        through the latest pairs; jitter (ms, standard deviation), by second differences, which drift does not touch. NaN before there are
        enough pairs."""
        offset, drift, jitter = self._line(list(self._pairs))
        return {'shutter offset (ms)': 1e3 * offset, 'shutter drift (ppm)': 1e6 * drift, 'shutter jitter (ms)': 1e3 * jitter}

    @property
    def remark(self) -> str:
        """Warning of an offset beyond the limit; '' for none."""
        offset = abs(self._line(list(self._pairs))[0])
        if not offset > self._limit / _NS:
            return ''
        return (f'the exposures of the two cameras are {1e3 * offset:.1f} ms apart, but max_skew is {self._limit / 1e6:.1f} ms: no '
                'image_raw; set max_skew to -1 (half a frame period), or trigger the cameras')

    @staticmethod
    def _line(pairs: list[tuple[int, int]]) -> tuple[float, float, float]:
        """Offset, s, and drift, s/s, of a least-squares line through (left stamp, offset), ns, and jitter, s; NaN for too few."""
        if len(pairs) < _FEWEST:
            return math.nan, math.nan, math.nan
        # The last stamp is subtracted as an integer: stamps are too large for doubles.
        t, offset = np.array([(stamp - pairs[-1][0], offset) for stamp, offset in pairs], float).T / _NS
        slope, last = np.polyfit(t, offset, 1)
        jitter = np.sqrt(np.mean(np.diff(offset, 2)**2) / 6)  # white noise has second differences of six times its variance
        return float(last), float(slope), float(jitter)
