# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Time in sources: stamps on the ROS clock of what was captured on the monotonic clock, and an even pace without drift."""
from __future__ import annotations

import time

from .protocol import Clock

NS = 1_000_000_000
_PROMPT_NS, _TRIES = 50_000, 4


def stamp_of(captured_ns: int, clock: Clock) -> int:
    """The stamp, ns on clock, of what happened at captured_ns on time.monotonic_ns(); steps of the wall clock between the two do no
    harm."""
    # Simulated time stands at 0 until its first message.
    return max(captured_ns + _between(clock), 0)


def _between(clock: Clock) -> int:
    """clock less time.monotonic_ns(), ns: read until nothing has come in between, which on a busy machine may take milliseconds."""
    best, offset = None, 0
    for _ in range(_TRIES):
        before, now, after = time.monotonic_ns(), clock(), time.monotonic_ns()
        if best is None or after - before < best:
            best, offset = after - before, now - (before + after) // 2
        if best < _PROMPT_NS:
            break
    return offset


def wait_until(due_ns: int) -> None:
    """Sleep until due_ns on time.monotonic_ns()."""
    left = due_ns - time.monotonic_ns()
    if left > 0:
        time.sleep(left / NS)


class EvenPace:
    """Instants at a fixed rate, Hz, on deadlines that do not drift.

    A caller that comes late by whole periods skips them when skip is set (a camera goes on; skipped counts them), else the instants to come
    are moved (a recording waits).
    """

    def __init__(self, rate: float, skip: bool):
        self.skipped = 0
        self._period = NS / rate
        self._skip = skip
        self._origin = None
        self._count = 0

    def next(self) -> int:
        """The next instant on time.monotonic_ns(); does not wait."""
        now = time.monotonic_ns()
        if self._origin is None:
            self._origin = now
        behind = int((now - self._origin) / self._period) - self._count
        if behind > 0 and self._skip:
            self._count += behind
            self.skipped += behind
        elif behind > 0:
            self._origin += int(behind * self._period)
        due = self._origin + int(self._count * self._period)
        self._count += 1
        return due


class StampPace:
    """Instants as far apart as recorded stamps are; moved when the caller is late or the stamps jump by more than longest_gap_s."""

    def __init__(self, longest_gap_s: float = 5.0):
        self._longest_gap = int(longest_gap_s * NS)
        self._last = None

    def next(self, stamp_ns: int) -> int:
        """The instant on time.monotonic_ns() at which the frame stamped stamp_ns is due; does not wait."""
        now = time.monotonic_ns()
        due = now
        if self._last is not None and 0 <= stamp_ns - self._last[0] <= self._longest_gap:
            due = self._last[1] + stamp_ns - self._last[0]
        # Late by more than a moment (the node was paused): go on from here instead of rushing to catch up.
        due = due if now - due < NS // 10 else now
        self._last = stamp_ns, due
        return due
