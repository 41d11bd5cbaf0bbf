# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Counts messages that did not arrive, by the gaps that they leave in the stamps of those that did. No ROS here."""
from __future__ import annotations

from collections import deque
from statistics import median

_KEPT = 30  # steps between stamps, of which the period is known: a camera that changes its rate is followed within as many frames
_EVERY = 5  # steps the period is found anew: 57 us for each message of a busy machine would be too much
_SHORTEST_NS = 100_000  # no sensor sends 10 000 messages a second: such stamps are wrong
_PAUSE_NS = 2_000_000_000  # a longer gap is the publisher's own: it was paused, or plugged in again
_SHORT = 0.1  # of the steps may be shorter than a period: messages that were late
_LATELY = 120  # messages
_FEW = 3  # of these that are lost are no news: the machine did something else for a moment
_JITTER, _MOST = 0.25, 0.9  # of a period, by which a whole multiple of it may be off; of all steps that have to be one


class StampGaps:
    """Follows the stamps of a stream. topic: for what is said of it; lost: how many messages are missing so far."""

    def __init__(self, topic: str):
        self.lost, self._topic = 0, topic
        self._missing: deque[int] = deque(maxlen=_LATELY)
        self._steps: deque[int] = deque(maxlen=_KEPT)
        self._last_ns: int | None = None
        self._end_ns = self._count = 0
        self._period = 0.0

    def restart(self) -> None:
        """Count nothing from the last message to the next: nobody listened in between."""
        self._last_ns = None

    def add(self, stamp_ns: int, covered_ns: int = 0) -> None:
        """Count what is missing before the message with this stamp; covered_ns: the time that its samples take, 0 where messages come at
        a fixed rate. Stamps that go back begin anew."""
        last_ns, end_ns = self._last_ns, self._end_ns
        self._last_ns, self._end_ns = stamp_ns, stamp_ns + covered_ns
        step = 0 if last_ns is None else stamp_ns - last_ns
        if not _SHORTEST_NS <= step <= _PAUSE_NS:
            return
        self._steps.append(step)
        self._count += 1
        if self._count % _EVERY == 0:
            self._period = self._found_period()
        if not self._period:
            return
        missing = max(round((stamp_ns - (end_ns if end_ns > last_ns else last_ns + self._period)) / self._period), 0)
        self.lost += missing
        self._missing.append(missing)

    @property
    def remark(self) -> str:
        """What to say where more than a few of the latest messages are missing, else ''."""
        lost = sum(self._missing)
        if lost <= _FEW:
            return ''
        share = 100 * lost / (lost + len(self._missing))
        return (f'{share:.0f} % of {self._topic} did not arrive, by the gaps in its stamps; see what its publisher leaves out, whether it '
                'is reliable, and what else the machine and the network do')

    def _found_period(self) -> float:
        """The step from message to message, ns: the median one; where so many are lost that it is a multiple, that of which the steps are
        whole multiples, found from the shortest to the longest."""
        steps = sorted(self._steps)
        period, count, total = steps[int(_SHORT * len(steps))], 0, 0
        for step in steps:
            count, total = count + max(round(step / period), 1), total + step
            period = total / count
        whole = sum(abs(step / period - round(step / period)) < _JITTER for step in steps)
        return period if whole >= _MOST * len(steps) else median(steps)
