# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Load of a taxel from the load that its sensing layer shows: a part of it held by play with relaxation, and its inverse.

A part of what the layer shows is a held load, which stays until the load is farther from it than its reach, follows at that distance (play
operator, Visintin 1994), and creeps towards a load that rests. The reach may grow with the load.
"""
from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import cv2
import numpy as np

from .._core import taxel_undone
from ..errors import BadArgument

# Tried in the fit: parts held; reaches, of the largest load, and of each load; s. Chosen: of a layer that holds more than half of its
# changes a frame shows too little to tell the load; one that comes back through less than the whole range shows its reach.
_HARD, _SOFT = 0.5, (0.25, 0.12, 0.06)
_REACHES = (0.0, 0.005, *np.geomspace(0.01, 0.32, 11).tolist())
_RELATIVE = (0.0, 0.04, 0.08, 0.16, 0.32)
_MOST_HELD = 0.9  # largest share of a loop. Chosen: beyond, noise is ten times as large
_FARTHEST = 0.5  # of the largest load, up to which both reaches together are tried. Derived: farther, it is not seen on the way back
_RELAXATIONS = np.geomspace(0.1, 10, 9).tolist()
_BETTER = 0.7  # of the residuals without a loop, below which those with one must be. Chosen: noise alone gains a few percent
# Of the residuals of _HARD, below which those of a smaller one must be. Chosen: a fitted curve that is not quite that of the
# layer looks like a small share with a far reach.
_SOFTER = 0.8
_RESTED_S = 1e6  # s, before the first load
_NOISE = 0.3  # of the hidden part's share of changes: how much of it adds to the noise. Derived: it is blurred by a taxel
# s, in which the largest load is forgotten at most. Chosen: a light hold that follows on a heavy one is told again by then
_LONGEST_S = 0.5
_SMOOTH = 1.0  # taxels, of the Gaussian by which neighbours tell together whether their load rises or falls. Chosen


@dataclass(frozen=True)
class Loop:
    """The loop between rising and falling loads.

    share: part of the held load in what is shown, 0 for no loop; reach: Pa, and relative: part of the load, farthest distance of load and
    held load; relaxation: s, in which the held load comes to a load that rests. Raises BadArgument for numbers that are no loop.
    """

    share: float = 0.0
    reach: float = 0.0
    relative: float = 0.0
    relaxation: float = 1.0

    def __post_init__(self):
        if not (0 <= self.share <= _MOST_HELD and 0 <= self.reach < np.inf and 0 <= self.relative <= 1 and 0 < self.relaxation < np.inf):
            raise BadArgument(f'taxel response: a loop needs a share from 0 to {_MOST_HELD}, a reach of at least 0, a relative reach from '
                              f'0 to 1 and a positive relaxation, got {self.share}, {self.reach}, {self.relative}, {self.relaxation}')

    def width(self, load: float | np.ndarray) -> float | np.ndarray:
        """Largest difference, Pa, between what is shown of the same load as it rises to load, Pa, and as it falls from there."""
        return 2 * self.share * np.minimum(self.reach + self.relative * load, 0.5 * load)

    @property
    def noise_gain(self) -> float:
        """Noise of the loads over that of what is shown."""
        return 1 + _NOISE * self.share / (1 - self.share)

    def shown(self, loads: np.ndarray, intervals: np.ndarray) -> np.ndarray:
        """What the layer shows (N,) of loads (N,), Pa, that follow each other after intervals (N,) s."""
        found, held, last = np.empty(len(loads)), 0.0, 0.0
        for k, (load, interval) in enumerate(zip(loads.tolist(), intervals.tolist())):
            held += (last - held) * -math.expm1(-interval / self.relaxation)
            reach = self.reach + self.relative * max(load, 0.0)
            held = min(max(held, load - reach), load + reach)
            found[k], last = (1 - self.share) * load + self.share * held, load
        return found


def fit_loop(times: np.ndarray, loads: np.ndarray, terms: np.ndarray, weights: np.ndarray) -> Loop:
    """The loop by loads (N,), Pa, at times (N,) s in their order, some of them rising and some falling.

    terms: (N, K), nonnegative combinations of which are what the layer shows; weights: (N,) of the residuals, 0 to leave one out. No loop
    where one does not explain the loads much better than none.
    """
    from scipy.optimize import nnls  # calibration alone needs it
    intervals, unit = np.diff(times, prepend=times[0] - _RESTED_S), np.maximum(np.abs(terms).max(axis=0), 1e-300)
    most = float(loads.max())

    def left(loop: Loop) -> float:
        return nnls(terms / unit * weights[:, None], loop.shown(loads, intervals) * weights)[1]

    def best(shares: tuple) -> tuple[float, Loop]:
        """The least residual with one of these shares, and its loop."""
        loops = [Loop(share, most * reach, relative, relaxation) for share, reach, relative, relaxation in
                 product(shares, _REACHES, _RELATIVE, _RELAXATIONS) if 0 < reach + relative <= _FARTHEST]
        residuals = [left(loop) for loop in loops]
        return min(residuals), loops[int(np.argmin(residuals))]

    hard, soft = best((_HARD,)), best(_SOFT)
    least, loop = soft if soft[0] <= _SOFTER * hard[0] else hard
    return loop if least < _BETTER * left(Loop()) else Loop()


class Hysteresis:
    """Undoes a loop frame by frame."""

    def __init__(self, loop: Loop):
        self._loop = loop
        self.reset()

    def reset(self) -> None:
        """Forget earlier frames: loads are as shown."""
        self._load: np.ndarray | None = None

    def undone(self, pressure: np.ndarray, interval_s: float) -> np.ndarray:
        """The load (rows, columns) Pa behind the pressure (rows, columns) float32 that is shown, interval_s after the last frame."""
        loop = self._loop
        if not loop.share:
            return pressure
        last, held = (pressure, pressure) if self._load is None else (self._load, self._held)
        self._load, self._held = taxel_undone(pressure, last, held, share=loop.share, reach=loop.reach, relative=loop.relative,
                                              crept=-math.expm1(-interval_s / loop.relaxation), smooth=_SMOOTH)
        return self._load


class Memory:
    """Tells what a layer still shows of a load that is gone from a touch.

    A law that is not quite that of the layer leaves a part of its loop: less than what shows at once of the loop's width at the recent
    largest load of a taxel. It only falls, while a new touch rises.
    """

    def __init__(self, loop: Loop):
        self._loop = loop
        self.reset()

    def reset(self) -> None:
        """Forget earlier frames."""
        self._largest: np.ndarray | None = None

    def follow(self, load: np.ndarray, interval_s: float) -> None:
        """Take the loads (rows, columns) float32, Pa, with the loop undone, interval_s after the last frame."""
        loop = self._loop
        if not loop.share:
            return
        load = cv2.GaussianBlur(load, (0, 0), _SMOOTH)
        if self._largest is None:
            self._largest = self._lowest = load
        self._largest = np.fmax(load, self._largest * np.float32(math.exp(-interval_s / min(loop.relaxation, _LONGEST_S))))
        self._more = ~(load <= (1 - loop.share) * loop.width(self._largest))  # unknown loads too
        self._lowest = np.where(self._more, load, np.fmin(self._lowest, load))
        self._rise = load - self._lowest

    def explains(self, box: tuple[slice, slice], touched: np.ndarray, least: float) -> bool:
        """Whether the last loads are nothing else in the touched taxels of a box, bool; least: rise of a load, Pa, that tells a touch."""
        return bool(self._loop.share) and not (touched & (self._more[box] | (self._rise[box] > least))).any()
