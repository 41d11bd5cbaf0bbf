# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Brings together the messages that carry one stamp, whichever of them exist. No ROS here."""
from __future__ import annotations

from collections.abc import Callable, Collection

_FAR_NS = 60_000_000_000  # ahead of others: a stamp that no frame has, whose set would wait for ever


class StampSync:
    """Collects messages by stamp and hands over each set when it is complete.

    done: called with topic -> message; expected: says which topics make a set complete at present; patience: how many younger stamps an
    incomplete set waits for before it is handed over as it is. A set older than one that is complete is let go: it comes too late.
    """

    def __init__(self, done: Callable[[dict], None], expected: Callable[[], Collection[str]], patience: int = 8):
        self._done, self._expected, self._patience = done, expected, patience
        self._sets: dict[int, dict] = {}
        self._last: int | None = None

    def add(self, topic: str, stamp_ns: int, message: object) -> None:
        """Take one message; stamps, ns, that go back by more than a second begin anew."""
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
