# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the simulated sources share: a scene played in real time."""
from __future__ import annotations

from ...errors import BadArgument
from .pacing import EvenPace, stamp_of, wait_until
from .protocol import Clock, Source


class SceneSource(Source):
    """A scene of a simulated sensor in real time, again from its start when it is over.

    scene: its name; rate: Hz, or -1 for usual_rate; seed: of noise and specimen; clock: ns for the stamps; count: steps of the scene per
    read. The scene stands still while it is not wanted. Subclasses define _open_scene, _make and _handed_over.
    """

    truths = ('contacts', 'contact_region', 'slip', 'wrench')
    live = True
    usual_rate = 30.0
    longest_leap = 2  # steps caught up at once; chosen: computing more would delay the next one

    def __init__(self, scene: str, rate: float, seed: int, clock: Clock, count: int = 1):
        self.rate = self.rate_of(rate)
        self._name, self._seed, self._clock, self._count = scene, seed, clock, count
        self._scene = self._pace = None
        self._number = 0

    @classmethod
    def rate_of(cls, rate: float) -> float:
        """The rate, Hz, with usual_rate for -1. Raises BadArgument for 0."""
        if rate == 0:
            raise BadArgument(f'rate: source sim runs in real time, so 0 is not allowed; give one in Hz, or -1 for {cls.usual_rate:g} Hz')
        return rate if rate > 0 else cls.usual_rate

    @property
    def skipped(self) -> int:
        """Number of steps that were skipped because computing was late."""
        return self._pace.skipped * self._count if self._pace else 0

    def open(self) -> None:
        """Open the scene at its start. Raises BadArgument, listing the scenes, for an unknown one."""
        self._scene = self._open_scene()
        self._pace = EvenPace(self.rate / self._count, skip=True)
        self._number = 0

    def read(self, wanted: bool = True):
        """The next step, computed ahead and returned when due; None if it is not wanted."""
        skipped = self._pace.skipped
        due = self._pace.next()
        if not wanted:
            wait_until(due)
            return None
        # Skipped steps have to be computed too: catching up fully after a long stall would cause the next stall.
        self._number += self._count * min(self._pace.skipped - skipped, self.longest_leap)
        made = self._make(self._number)
        self._number += self._count
        self._compute_ahead(due)
        wait_until(due)
        return self._handed_over(made, due)

    def close(self) -> None:
        """Drop the scene."""
        self._scene = None

    def describe(self) -> dict:
        """The scene, its seed and rate."""
        return {'source': 'sim', 'device': 'simulated', 'scene': self._name, 'seed': self._seed, 'rate': self.rate}

    def _open_scene(self):
        raise NotImplementedError

    def _make(self, number: int):
        """Compute steps number to number + count of the scene."""
        raise NotImplementedError

    def _compute_ahead(self, due_ns: int) -> None:
        """Use the time until due_ns of the monotonic clock for later steps; nothing where each step takes the same time."""

    def _handed_over(self, made, due_ns: int):
        """The result of _make as the source's data, due at due_ns of the monotonic clock."""
        raise NotImplementedError

    def _stamp(self, due_ns: int) -> int:
        return stamp_of(due_ns, self._clock)
