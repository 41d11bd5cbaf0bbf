# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The object's rigid motion over a fixed interval from sticking dots, and the slip of the other dots relative to it."""
from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from ...common.rigid_motion import RigidFit, fit_rigid_robust
from ...errors import BadArgument, BadFrame, DegenerateFit
from .region import ContactDots

_FEWEST = 6  # dots that must agree on a motion; chosen: twice the three that determine it


@dataclass(frozen=True)
class MotionEstimate:
    """motion: of the object over interval, s, of the largest region with a known motion if there are more, None and NaN when unknown;
    slip: (N, 3) m, of each dot over its own object in that time, NaN for dots that are free or were not seen before, and where the motion
    is unknown.
    """

    motion: RigidFit | None
    interval: float
    slip: np.ndarray


class ObjectMotion:
    """The object's motion over the last interval_s, s, frame by frame, on a rows x columns grid.

    A robust rigid fit to the dots of each separate region that stuck during the whole interval. In gross slip no dot sticks and the motion
    is unknown.
    """

    def __init__(self, rows: int, columns: int, interval_s: float = 0.1):
        if not 0 < interval_s < np.inf:
            raise BadArgument(f'object motion: interval_s must be positive, got {interval_s}')
        self.rows, self.columns, self.interval_s = rows, columns, interval_s
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        self._past: deque[tuple[float, np.ndarray, np.ndarray]] = deque()
        self._stuck = np.zeros(self.rows * self.columns, np.int64)  # frames up to the last in which each dot stuck without a break

    def process(self, dots: ContactDots, stamp_s: float, regions: list[np.ndarray] | None = None) -> MotionEstimate:
        """Motion up to this frame. regions: the members (N,) bool of each separate region, largest first; None: all dots are one region's.

        Raises BadFrame for a stamp that is not later than the last.
        """
        if not np.isfinite(stamp_s) or (self._past and stamp_s <= self._past[-1][0]):
            raise BadFrame(f'object motion: stamp {stamp_s} s is not later than the last; frame skipped')
        states = np.zeros(self.rows * self.columns, np.uint8)
        states[dots.ids] = dots.state
        places = np.full((self.rows * self.columns, 3), np.nan)
        places[dots.ids] = dots.xyz
        self._past.append((stamp_s, places, states))
        self._stuck = (self._stuck + 1) * (states == 1)
        while len(self._past) > 2 and self._past[1][0] <= stamp_s - self.interval_s * (1 - 1e-6):
            self._past.popleft()
        return self._estimate(dots, stamp_s, [np.ones(len(dots.ids), bool)] if regions is None else regions)

    def _estimate(self, dots: ContactDots, stamp_s: float, regions: list[np.ndarray]) -> MotionEstimate:
        unknown = MotionEstimate(None, np.nan, np.full((len(dots.ids), 3), np.nan))
        since, before, first = self._past[0]
        if len(self._past) < 2 or not first.any():
            return unknown
        known = (first[dots.ids] > 0) & (np.asarray(dots.state) > 0)
        chosen, first_motion, slip = known & (self._stuck[dots.ids] >= len(self._past) - 1), None, unknown.slip
        before = before[dots.ids]
        for members in regions:
            motion = _shared_motion(before, dots, chosen & members)
            if motion is not None:
                first_motion = first_motion or motion
                moving = known & members
                slip[moving] = dots.xyz[moving] - motion.apply(before[moving])
        return MotionEstimate(first_motion, stamp_s - since, slip) if first_motion else unknown


def _shared_motion(before: np.ndarray, dots: ContactDots, sticking: np.ndarray) -> RigidFit | None:
    """The motion that at least half of the sticking (N,) dots share; None without such a motion or if they do not determine it."""
    if np.count_nonzero(sticking) < _FEWEST:
        return None
    before, now = before[sticking], dots.xyz[sticking]
    try:
        motion = fit_rigid_robust(before, now, np.sqrt(2) * dots.sigma)
    except DegenerateFit:
        return None
    return motion if np.count_nonzero(motion.weights) >= max(_FEWEST, len(before) / 2) else None
