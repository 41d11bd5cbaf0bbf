# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Breakaway of a smooth flat face, and the end of a motion, by the speed of the picture.

While an object sticks, its traction grows with its motion, and the picture leads it by ever more. Once all of it slides, traction grows no
more, and the picture is only as fast as the object: of an object that keeps its speed the picture slows down by a known factor at once.
One that sticks and slows down by just that factor looks the same.
"""
from __future__ import annotations

import numpy as np

STRETCH_S = 0.04  # s, before and after the change, over which speeds are compared. Chosen: four frames at 100 Hz
SHORT_S = 0.02  # s, the same for fast objects, whose missing way is soon more than noise. Chosen: a change within a frame is told from it
SIGMAS = 7.0  # standard deviations of a place, of the way that is missing. Chosen: the difference of two ways has 2.4
PHASE = 0.04  # taxels, missing way at least. Chosen: twice what registration errs by with the phase between object and taxels
# Frames over which an object that moves must move on, by at least so much of the way that its speed lets expect; a shorter way than so many
# standard deviations of a place tells nothing. Chosen.
LATEST, _GOES_ON, _EXPECTED_SIGMAS = 3, 0.25, 2.5
_STOPPED = 0.5  # of the expected speed, below which the object itself has slowed down. Chosen


def broke_away(times: np.ndarray, places: np.ndarray, lead: float, least: float) -> bool:
    """Whether an object that stuck has begun to slide, by places (N,), m, along its motion, at times (N,) s, that it would have if it still
    stuck.

    lead: speed of the picture of an object that sticks over its own, more than 1; least: m, of the way that is missing.
    """
    return _changed(times, places, lead, least, STRETCH_S) or _changed(times, places, lead, least, SHORT_S, lasts=True)


def _changed(times: np.ndarray, places: np.ndarray, lead: float, least: float, stretch: float, lasts: bool = False) -> bool:
    """Whether the speed in the last stretch, s, is that of an object that broke away before it; lasts: and in both halves of it, which hold
    a frame each. See broke_away."""
    if times[-1] - times[0] < 2 * stretch - 1e-6 or lasts and np.count_nonzero(times > times[-1] - stretch + 1e-6) < 2:
        return False
    before, first, second = np.diff(np.interp(times[-1] - np.array([2, 1, 0.5, 0]) * stretch, times, places)).tolist()
    slowest, fastest = _STOPPED * before / lead, 0.5 * (1 + 1 / lead) * before
    after = (first + second, 2 * first, 2 * second) if lasts else (first + second,)
    return before - after[0] > least and all(slowest < one < fastest for one in after)


def has_stopped(expected: float, went: float, noise: float) -> bool:
    """Whether an object has not moved on in the last LATEST frames, though a line through its places still has a speed: the line may hold
    the end of a motion. expected: m, way by that speed; went: m, way along it; noise: standard deviation of a place, m."""
    return expected > _EXPECTED_SIGMAS * noise and went < _GOES_ON * expected
