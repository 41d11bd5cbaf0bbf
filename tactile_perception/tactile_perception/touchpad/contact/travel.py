# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Velocity of curved tips over the surface: that of their contacts over the dots."""
from __future__ import annotations

from collections import deque

import numpy as np

from ...common.estimates import ContactEstimate
from .region import ContactDots

_TIP = 0.15e-3  # m, standard deviation of a contact's place: that of a face or an edge is larger; chosen
_FEWEST = 3  # frames; chosen: one more than a velocity needs
_WINDOW_S = 0.2  # s, over which a velocity is measured at most; chosen
_EVEN = 2.0  # mean square deviation from an even motion, in that of the places; chosen
_SIGNIFICANT = 8.0  # standard deviations above which a velocity is told: 12 % of error each; chosen
_LIFTED = 0.15e-3  # m, by which a tip that is lifted rises: what is left of its contact moves otherwise than it does; chosen
_LATE_S, _CHANGE = 0.07, 0.4  # s, part of the velocity: largest change in the last part of the window; chosen

_FADES = 0.7  # of the dots' usual motion in a frame: below it a tip counts as slowing down; chosen


class ContactTravel:
    """The paths of contacts over the dots, frame by frame.

    The lowest point of a curved tip follows the tip, so it moves over the dots as the tip slides, or rolls. The border of a face lags
    behind it: nothing is known of a face.
    """

    def __init__(self):
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        self._past: deque[tuple[float, np.ndarray, dict[int, tuple[np.ndarray, float, np.ndarray, float]]]] = deque()

    def add(self, dots: ContactDots, contacts: list[ContactEstimate], stamp_s: float) -> None:
        """Take a frame at stamp_s, s, later than the last."""
        places, tips = np.full((dots.rows * dots.columns, 2), np.nan), {}
        places[dots.ids] = dots.xyz[:, :2]
        for contact in contacts:
            variance = contact.position_covariance[0, 0] + contact.position_covariance[1, 1]
            if variance < _TIP**2:
                held = np.zeros(len(places), bool)
                held[dots.ids[contact.members]] = True
                tips[contact.id] = contact.position[:2], float(variance), held, contact.depth
        self._past.append((stamp_s, places, tips))
        while self._past[0][0] < stamp_s - _WINDOW_S * (1 + 1e-6):
            self._past.popleft()

    def velocity(self, number: int) -> np.ndarray:
        """(2,) m/s of a contact over its dots, the mean of the longest time of even motion up to the last frame; NaN where it is not known
        to an eighth, where the contact has just changed its speed, and where its tip is lifted."""
        seen = []
        for stamp, places, tips in self._past:
            seen = [*seen, (stamp, places, *tips[number])] if number in tips else []
        if len(seen) < _FEWEST:
            return np.full(2, np.nan)
        stamps, places, tips, variance, held, depth = (np.array(part) for part in zip(*seen[::-1]))
        common = held.all(axis=0)
        if not common.any() or depth[_FEWEST - 1] - depth[0] > _LIFTED:
            return np.full(2, np.nan)
        path = tips - places[:, common].mean(axis=1)
        found, frames = _even_velocity(stamps - stamps[0], path - path[0], variance)
        return np.full(2, np.nan) if _fades(places[:frames, common]) else found


def _fades(places: np.ndarray) -> bool:
    """Whether dots at places (T, N, 2), m, latest first, move less in the last frame than before: the faster the dent of a tip passes over
    the dots, the more they move."""
    steps = np.sqrt(((places[1:] - places[:-1])**2).mean(axis=(1, 2)))
    return bool(steps[0] < _FADES * np.median(steps))


def _even_velocity(seconds: np.ndarray, path: np.ndarray, variance: np.ndarray) -> tuple[np.ndarray, int]:
    """(2,) m/s, least squares over the longest even part of path (T, 2), m, at seconds (T,) with variance (T,), m^2, latest first, and the
    number of its frames."""
    count = np.arange(1.0, len(seconds) + 1)
    spread = np.cumsum(seconds**2) - np.cumsum(seconds)**2 / count
    product = np.cumsum(seconds[:, None] * path, axis=0) - (np.cumsum(seconds) / count)[:, None] * np.cumsum(path, axis=0)
    scatter = np.cumsum((path**2).sum(axis=1)) - (np.cumsum(path, axis=0)**2).sum(axis=1) / count
    noise = np.cumsum(variance) / count
    few = _FEWEST - 1
    velocity = product[few:] / spread[few:, None]
    even = scatter[few:] - (velocity * product[few:]).sum(axis=1) < _EVEN * noise[few:] * (count[few:] - 2)
    last = len(even) if even.all() else int(np.argmin(even))
    if not last:
        return np.full(2, np.nan), _FEWEST
    found, at = velocity[last - 1], last + few - 1
    speed = np.linalg.norm(found)
    if not speed > _SIGNIFICANT * np.sqrt(noise[at] / spread[at]):
        return np.full(2, np.nan), at + 1
    late = min(max(few, int(np.searchsorted(-seconds, _LATE_S - 1e-6))), at)
    recent = (path[0] - path[late]) @ found / (seconds[0] - seconds[late]) / speed
    return (found if abs(recent - speed) < _CHANGE * speed else np.full(2, np.nan)), at + 1
