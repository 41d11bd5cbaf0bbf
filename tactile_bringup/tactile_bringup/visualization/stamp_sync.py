# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Collects messages of equal stamp. Needs no ROS."""
from __future__ import annotations

from collections.abc import Callable, Collection

_FAR_NS = 60_000_000_000  # 60 s, chosen: a set this far ahead has a wrong stamp and would never be completed; it is dropped


class StampSync:
    """Collects messages by stamp and passes on each set when it is complete.

    done: called with a dict of messages by topic; expected: returns the topics of a complete set; patience: number of waiting sets above
    which the oldest is passed on incomplete. Sets older than the one passed on are dropped.
    """

    def __init__(self, done: Callable[[dict], None], expected: Callable[[], Collection[str]], patience: int = 8):
        self._done, self._expected, self._patience = done, expected, patience
        self._sets: dict[int, dict] = {}
        self._last: int | None = None

    def add(self, topic: str, stamp_ns: int, message: object) -> None:
        """Add one message. A stamp, ns, that goes back by more than 1 s restarts the collection; other late messages are dropped."""
        if self._last is not None and stamp_ns <= self._last:
            if self._last - stamp_ns < 1_000_000_000:
                return
            self._sets, self._last = {}, None
        self._sets = {stamp: kept for stamp, kept in self._sets.items() if stamp - stamp_ns < _FAR_NS}
        self._sets.setdefault(stamp_ns, {})[topic] = message
        if self._sets[stamp_ns].keys() >= set(self._expected()):
            self._hand_over(stamp_ns)
        elif len(self._sets) > self._patience:
            self._hand_over(min(self._sets))

    def _hand_over(self, stamp_ns: int) -> None:
        found, self._last = self._sets[stamp_ns], stamp_ns
        self._sets = {stamp: kept for stamp, kept in self._sets.items() if stamp > stamp_ns}
        self._done(found)
