# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Load of a taxel from the load that its sensing layer shows: play with relaxation, and its inverse.

The layer follows a load only where it differs by more than the loop's half width (play operator, Visintin 1994), and creeps towards a
load that rests.
"""
from __future__ import annotations

import math

import numpy as np

from .._core import taxel_undone

_WIDTHS, _RELAXATIONS = np.linspace(0, 0.1, 41), np.geomspace(0.05, 10, 17)  # of the largest load; s: tried in the fit. Chosen
_BETTER = 0.7  # of the residuals without a loop, below which those with one must be. Chosen: noise alone gains a few percent
_RESTED_S = 1e6  # s, before the first load
NOISE_GAIN = 1.3  # noise of the loads over that of what is shown. Derived: the hidden part repeats the noise, blurred by a taxel
_SMOOTH = 1.0  # taxels, of the Gaussian by which neighbours tell together whether their load rises or falls. Chosen


def shown(loads: np.ndarray, intervals: np.ndarray, width: float, relaxation: float) -> np.ndarray:
    """What the layer shows (N,) of loads (N,) that follow each other after intervals (N,) s; width: half of the loop's, in the loads' unit;
    relaxation: s."""
    found, stuck = np.empty(len(loads)), 0.0
    for k, (load, interval) in enumerate(zip(loads.tolist(), intervals.tolist())):
        stuck = min(max(stuck, load - width), load + width)
        stuck += (load - stuck) * -np.expm1(-interval / relaxation)
        found[k] = stuck
    return found


def fit_loop(times: np.ndarray, loads: np.ndarray, terms: np.ndarray, weights: np.ndarray) -> tuple[float, float]:
    """Half of the loop's width, in the unit of loads, and relaxation, s, by loads (N,) at times (N,) s in their order, some of them rising
    and some falling.

    terms: (N, K), nonnegative combinations of which are what the layer shows; weights: (N,) of the residuals, 0 to leave one out. (0, 1)
    where a loop does not explain the loads much better than none.
    """
    from scipy.optimize import nnls  # calibration alone needs it
    intervals, unit = np.diff(times, prepend=times[0] - _RESTED_S), np.maximum(np.abs(terms).max(axis=0), 1e-300)

    def left(width: float, relaxation: float) -> float:
        return nnls(terms / unit * weights[:, None], shown(loads, intervals, width, relaxation) * weights)[1]
    tried = {(0.0, 1.0): left(0.0, 1.0)}
    tried |= {(w, r): left(w, r) for w in (loads.max() * _WIDTHS[1:]).tolist() for r in _RELAXATIONS.tolist()}
    best = min(tried, key=tried.get)
    return best if tried[best] < _BETTER * tried[0.0, 1.0] else (0.0, 1.0)


class Hysteresis:
    """Undoes play frame by frame. width: Pa, half of the loop's; relaxation: s."""

    def __init__(self, width: float, relaxation: float):
        self._width, self._relaxation = width, relaxation
        self.reset()

    def reset(self) -> None:
        """Forget earlier frames: loads are as shown."""
        self._last: np.ndarray | None = None

    def undone(self, pressure: np.ndarray, interval_s: float) -> np.ndarray:
        """The load (rows, columns) Pa behind the pressure (rows, columns) float32 that is shown, interval_s after the last frame.

        What the layer hides grows with each change until it is the loop's half width, and creeps out.
        """
        if not self._width:
            return pressure
        if self._last is None:
            self._last, self._hidden = pressure, np.zeros_like(pressure)
            return pressure
        load, self._hidden = taxel_undone(pressure, self._last, self._hidden, width=self._width,
                                          crept=-math.expm1(-interval_s / self._relaxation), smooth=_SMOOTH)
        self._last = pressure
        return load
