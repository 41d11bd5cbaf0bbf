# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Collects messages of equal stamp. Needs no ROS."""
from __future__ import annotations

from collections.abc import Callable, Collection

_BACK_NS, _SILENT_NS = 1_000_000_000, 2_000_000_000  # chosen


class StampSync:
    """Collects messages by stamp and passes on the sets that are complete, and no others.

    done: called with a dict of messages by topic; expected: returns the topics of a complete set; one that had nothing for 2 s of stamps
    is left out; patience: number of waiting sets above which the oldest is dropped. Sets older than the one passed on are dropped, too.
    """

    def __init__(self, done: Callable[[dict], None], expected: Callable[[], Collection[str]], patience: int = 30):
        self._done, self._expected, self._patience = done, expected, patience
        self._begin_anew(0)

    def _begin_anew(self, stamp_ns: int) -> None:
        self._sets: dict[int, dict] = {}
        self._begin, self._last = stamp_ns, -1
        self._heard: dict[str, int] = {}  # topic -> its last stamp

    def add(self, topic: str, stamp_ns: int, message: object) -> None:
        """Add one message. A stamp, ns, that goes back by more than 1 s or leaps by 2 s begins anew; other late messages are dropped."""
        if not self._heard or not -_BACK_NS < stamp_ns - self._heard.get(topic, stamp_ns) < _SILENT_NS:
            self._begin_anew(stamp_ns)
        self._heard[topic] = stamp_ns
        if stamp_ns <= self._last:
            return
        found = self._sets.setdefault(stamp_ns, {})
        found[topic] = message
        if found.keys() >= {name for name in self._expected() if stamp_ns - self._heard.get(name, self._begin) < _SILENT_NS}:
            self._last = stamp_ns
            self._sets = {stamp: kept for stamp, kept in self._sets.items() if stamp > stamp_ns}
            self._done(found)
        elif len(self._sets) > self._patience:
            del self._sets[min(self._sets)]
