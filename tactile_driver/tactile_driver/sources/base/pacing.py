# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Time in sources: ROS stamps for times of the monotonic clock, and playback at a steady rate."""
from __future__ import annotations

import time

from .protocol import Clock

NS = 1_000_000_000
_PROMPT_NS, _TRIES = 50_000, 4  # chosen: three clock reads take a few us on an idle machine


def stamp_of(captured_ns: int, clock: Clock) -> int:
    """The stamp, ns of clock, of an event at captured_ns of time.monotonic_ns()."""
    # Simulated time stands at 0 until its first message.
    return max(captured_ns + _between(clock), 0)


def _between(clock: Clock) -> int:
    """clock minus time.monotonic_ns(), ns; read again if the machine was busy in between."""
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
    """Due times at a fixed rate, Hz, without drift.

    skip: a caller that is late by whole periods skips them, as with a camera (skipped counts them); else the later due times shift, as with
    a recording.
    """

    def __init__(self, rate: float, skip: bool):
        self.skipped = 0
        self._period = NS / rate
        self._skip = skip
        self._origin = None
        self._count = 0

    def next(self) -> int:
        """The next due time, ns of time.monotonic_ns(); does not wait."""
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
    """Due times with the intervals of recorded stamps; shifted if the caller is late or the stamps jump by more than longest_gap_s."""

    def __init__(self, longest_gap_s: float = 5.0):
        self._longest_gap = int(longest_gap_s * NS)
        self._last = None

    def next(self, stamp_ns: int) -> int:
        """The due time, ns of time.monotonic_ns(), of the frame stamped stamp_ns; does not wait."""
        now = time.monotonic_ns()
        due = now
        if self._last is not None and 0 <= stamp_ns - self._last[0] <= self._longest_gap:
            due = self._last[1] + stamp_ns - self._last[0]
        # Late by over 0.1 s (chosen; the node was paused): continue from here instead of catching up.
        due = due if now - due < NS // 10 else now
        self._last = stamp_ns, due
        return due
