# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A scene of taxels: an object that moves from key to key, in steps that do not depend on the frame rate."""
from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..errors import BadArgument, by_name
from .constants import SIMULATION


class KeyedScene(ABC):
    """Base class of such a scene.

    rate: frames/s; times, keys: s, in order, and what the object does at them, linearly interpolated. A subclass calls _begin when it is
    made.
    """

    def __init__(self, rate: float, times: Sequence[float], keys: Sequence[Sequence[float]]):
        self.rate, self.duration = rate, times[-1]
        self._times, self._keys = np.array(times), np.array(keys)

    @property
    def frames(self) -> int:
        """Number of frames per round."""
        return math.ceil(self.duration * self.rate)

    @abstractmethod
    def _begin(self) -> None:
        """Return to the untouched sensor, and set _now, the time that was computed last, to 0."""

    def _at(self, time: float) -> np.ndarray:
        """What the object does at a time, s."""
        return np.array([np.interp(time, self._times, column) for column in self._keys.T])

    def _steps_to(self, time: float, step: float) -> tuple[float, list[float]]:
        """A time, s, within the scene, which repeats, and the times from the last one to it, in equal steps of at most step, s. An earlier
        time restarts the scene."""
        time = time % self.duration
        if time < self._now:
            self._begin()
        begin, steps = self._now, max(math.ceil((time - self._now) / step - SIMULATION.step_rounding), 1)
        return time, [begin + (time - begin) * k / steps for k in range(1, steps + 1)]


def open_keyed_scene(scenes: Mapping, name: str, rate: float, seed: int, play: Callable) -> KeyedScene:
    """The scene of that name: a script, which play(script, rate, seed) plays, or a function of rate and seed. Raises BadArgument for an
    unknown name (the message lists the known ones) or a rate that is not positive."""
    script = by_name(scenes, name, 'simulation: scene')
    if not 0 < rate < math.inf:
        raise BadArgument(f'simulation: rate is {rate!r}; give frames per second, more than 0')
    return script(rate, seed) if callable(script) else play(script, rate, seed)
