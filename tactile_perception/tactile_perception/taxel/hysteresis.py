# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Load of a taxel from the load that its sensing layer shows: a part of it late, a part held by play with relaxation, and their inverse.

Late parts follow the load with time constants (creep, a chain of Kelvin elements). Of the rest, a part is a held load, which stays until
the load is farther from it than its reach, follows at that distance (play operator, Visintin 1994), and creeps towards a load that rests.
The reach may grow with the load.
"""
from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product

import cv2
import numpy as np

from .._core import taxel_undone
from ..errors import BadArgument

# Tried in the fit: reaches, of the largest load, and of each load; s. Chosen: a layer that comes back through less than the whole range
# shows its reach.
_REACHES = (0.0, 0.005, *np.geomspace(0.01, 0.32, 8).tolist())
_RELATIVE = (0.0, 0.04, 0.08, 0.16, 0.32)
_RELAXATIONS = np.geomspace(0.1, 10, 5).tolist()
_LATE_S = (0.1, 0.4, 1.6, 6.4, 25.6)  # s, after which parts of a load are shown. Chosen: what lies between is a sum of two of them
_MOST_HELD = 0.9  # largest share of a loop, and of late parts. Chosen: beyond, noise is ten times as large
_FARTHEST = 0.5  # of the largest load, up to which both reaches together are tried. Derived: farther, it is not seen on the way back
_BETTER = 0.7  # of the residuals without a loop, below which those with one must be. Chosen: noise alone gains a few percent
# Of the residuals without late parts, below which those with them must be. Chosen: a hard loop that is not quite that of the layer looks
# like a softer one with a little that is late.
_SLOWER = 0.5
_RESTED_S = 1e6  # s, before the first load
_NOISE = 0.3  # of the hidden part's share of changes: how much of it adds to the noise. Derived: it is blurred by a taxel
# Of what is shown, up to which a load that does not rise may be left of one that is gone. Chosen: a law of the layer takes off at least the
# rest, and a light hold that follows on a heavy one is told again when less than as much is left.
_LEFT = 0.5
_SMOOTH = 1.0  # taxels, of the Gaussian by which neighbours tell together whether their load rises or falls. Chosen


@dataclass(frozen=True)
class Loop:
    """The loop between rising and falling loads.

    late: parts of a load that are shown after late_s, s, each; share: part of the held load in the rest, 0 for no loop; reach: Pa, and
    relative: part of the load, farthest distance of load and held load; relaxation: s, in which the held load comes to a load that rests.
    Raises BadArgument for numbers that are no loop.
    """

    share: float = 0.0
    reach: float = 0.0
    relative: float = 0.0
    relaxation: float = 1.0
    late: tuple[float, ...] = ()
    late_s: tuple[float, ...] = ()

    def __post_init__(self):
        if not (0 <= self.share <= _MOST_HELD and 0 <= self.reach < np.inf and 0 <= self.relative <= 1 and 0 < self.relaxation < np.inf):
            raise BadArgument(f'taxel response: a loop needs a share from 0 to {_MOST_HELD}, a reach of at least 0, a relative reach from '
                              f'0 to 1 and a positive relaxation, got {self.share}, {self.reach}, {self.relative}, {self.relaxation}')
        if not (len(self.late) == len(self.late_s) and all(0 <= part for part in self.late) and self.at_once >= 1 - _MOST_HELD and
                all(0 < time < np.inf for time in self.late_s)):
            raise BadArgument(f'taxel response: late parts of a loop need a positive time each, and a sum up to {_MOST_HELD}, got '
                              f'{self.late}, {self.late_s}')

    @property
    def is_none(self) -> bool:
        """Whether nothing is held and nothing late."""
        return not self.share and not self.late

    @property
    def at_once(self) -> float:
        """Part of a load that is not shown late."""
        return 1 - sum(self.late)

    def width(self, load: float | np.ndarray) -> float | np.ndarray:
        """Largest difference, Pa, between what is shown of the same load as it rises to load, Pa, and as it falls from there."""
        held = 2 * self.share * np.minimum(self.reach + self.relative * load, 0.5 * load)
        return self.at_once * held + sum(self.late) * load

    @property
    def noise_gain(self) -> float:
        """Noise of the loads over that of what is shown."""
        return (1 + _NOISE * self.share / (1 - self.share)) / self.at_once

    def shown(self, loads: np.ndarray, intervals: np.ndarray) -> np.ndarray:
        """What the layer shows (N,) of loads (N,), Pa, that follow each other after intervals (N,) s."""
        found = (1 - self.share) * loads + self.share * self.held(loads, intervals)
        return self.at_once * found + sum(part * followed(loads, intervals, time) for part, time in zip(self.late, self.late_s))

    def held(self, loads: np.ndarray, intervals: np.ndarray) -> np.ndarray:
        """The held load (N,) under loads (N,), Pa, that follow each other after intervals (N,) s."""
        found, held, last = np.empty(len(loads)), 0.0, 0.0
        for k, (load, crept) in enumerate(zip(loads.tolist(), (-np.expm1(-intervals / self.relaxation)).tolist())):
            held += (last - held) * crept
            reach = self.reach + self.relative * max(load, 0.0)
            found[k] = held = min(max(held, load - reach), load + reach)
            last = load
        return found


def followed(loads: np.ndarray, intervals: np.ndarray, time: float) -> np.ndarray:
    """Load (N,) that follows loads (N,), after intervals (N,) s, with a time constant, s."""
    found, late, last = np.empty(len(loads)), 0.0, 0.0
    for k, (load, gone) in enumerate(zip(loads.tolist(), (-np.expm1(-intervals / time)).tolist())):
        found[k] = late = late + (last - late) * gone
        last = load
    return found


def fit_loop(times: np.ndarray, loads: np.ndarray, terms: np.ndarray, weights: np.ndarray) -> Loop:
    """The loop by loads (N,), Pa, at times (N,) s in their order, some of them rising and some falling, and none after them.

    terms: (N, K), nonnegative combinations of which are what the layer shows; weights: (N,) of the residuals, 0 to leave one out. No loop
    where one does not explain the loads much better than none. What the layer shows late and what it holds add up to the load: for a
    reach and a relaxation, nonnegative least squares give all shares.
    """
    from scipy.optimize import nnls  # calibration alone needs it
    intervals, most = np.diff(times, prepend=times[0] - _RESTED_S), float(loads.max())
    lasts = [time for time in _LATE_S if time <= intervals[intervals < 0.5 * _RESTED_S].sum()]
    terms = terms / np.maximum(np.abs(terms).max(axis=0), 1e-300)

    loops = [Loop(0.0, most * reach, relative, relaxation) for reach, relative, relaxation in product(_REACHES, _RELATIVE, _RELAXATIONS)
             if 0 < reach + relative <= _FARTHEST]
    held_back = [loads - loop.held(loads, intervals) for loop in loops]

    def fitted(hidden: list[np.ndarray]) -> tuple[np.ndarray, float]:
        """Shares of what is hidden, and the residual."""
        parts, left = nnls(np.column_stack([terms, *hidden]) * weights[:, None], loads * weights)
        return parts[terms.shape[1]:], left

    def best(late_s: list[float]) -> tuple[float, Loop]:
        """The least residual with parts that are shown after late_s, s, and its loop."""
        least, found = np.inf, Loop()
        late = [loads - followed(loads, intervals, time) for time in late_s]
        for loop, hidden in zip(loops, held_back):
            parts, left = fitted([*late, hidden])
            slow = parts[:-1]
            if left < least and parts.sum() <= _MOST_HELD:
                least, found = left, replace(loop, share=float(parts[-1] / (1 - slow.sum())), late=tuple(slow[slow > 0].tolist()),
                                             late_s=tuple(np.array(late_s)[slow > 0].tolist()))
        return least, found

    none, (least, loop), (with_late, late_loop) = fitted([])[1], best([]), best(lasts)
    if with_late < _SLOWER * least:
        least, loop = with_late, late_loop
    return loop if least < _BETTER * none else Loop()


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
        if loop.is_none:
            return pressure
        if self._load is None:
            self._late = np.repeat(pressure[None], len(loop.late), axis=0)
            self._load = self._held = pressure
        if loop.late:
            gone = -np.expm1(-interval_s / np.float32(loop.late_s))
            step = self._load - self._late
            self._late += np.where(np.isfinite(step), step, 0) * gone[:, None, None]
            pressure = (pressure - np.tensordot(np.float32(loop.late), self._late, 1)) / np.float32(loop.at_once)
        self._load, self._held = taxel_undone(pressure, self._load, self._held, share=loop.share, reach=loop.reach, relative=loop.relative,
                                              crept=-math.expm1(-interval_s / loop.relaxation), smooth=_SMOOTH)
        return self._load


class Memory:
    """Tells what a layer still shows of a load that is gone from a touch.

    A law that is not quite that of the layer leaves a part of what it takes off. It only falls, while a new touch rises.
    """

    def __init__(self, loop: Loop):
        self._none = loop.is_none
        self.reset()

    def reset(self) -> None:
        """Forget earlier frames."""
        self._lowest: np.ndarray | None = None

    def follow(self, load: np.ndarray, shown: np.ndarray) -> None:
        """Take the loads, with the loop undone, and what is shown of them, both (rows, columns) float32, Pa."""
        if self._none:
            return
        load, shown = cv2.GaussianBlur(load, (0, 0), _SMOOTH), cv2.GaussianBlur(shown, (0, 0), _SMOOTH)
        self._more = ~(load <= _LEFT * shown)  # unknown loads too
        self._lowest = load if self._lowest is None else np.where(self._more, load, np.fmin(self._lowest, load))
        self._rise = load - self._lowest

    def explains(self, box: tuple[slice, slice], touched: np.ndarray, least: float) -> bool:
        """Whether the last loads are nothing else in the touched taxels of a box, bool; least: rise of a load, Pa, that tells a touch."""
        return not self._none and not (touched & (self._more[box] | (self._rise[box] > least))).any()
