# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Counts lost messages by the gaps in the stamps of the received ones. No ROS here."""
from __future__ import annotations

import time
from collections import deque

from .constants import DRIVER

RECENT_MESSAGES = 120  # latest messages over which losses are reported
SAME_CLOCK_S = 60.0  # a stamp further from now is of a recording, or of another clock
TOLERATED_LOSSES = 3  # losses among these that are not reported: the machine was busy for a moment


class StampGaps:
    """Follows the stamps of one stream. topic: its name in warning; lost: number of messages lost so far; missed: number of messages that
    were published before the first one arrived."""

    def __init__(self, topic: str):
        self.lost, self._topic = 0, topic
        self.missed, self._begun = 0, False
        self._missing: deque[int] = deque(maxlen=RECENT_MESSAGES)
        self._steps: deque[int] = deque(maxlen=DRIVER.period_intervals)
        self._last_ns: int | None = None
        self._end_ns = self._count = 0
        self._period = 0.0

    def begin(self, missed: int) -> None:
        """Note how many messages were published before the first one of a subscription; only the first subscription counts, later ones
        follow a period without subscribers."""
        if not self._begun:
            self.missed, self._begun = missed, True

    @property
    def note(self) -> str:
        """What was lost of a recording before the first message arrived, '' for nothing. A live sensor loses nothing by that."""
        recorded = self._last_ns is not None and abs(time.time_ns() - self._last_ns) > 1e9 * SAME_CLOCK_S
        if not self.missed or not recorded:
            return ''
        return (f'{self.missed} messages of {self._topic} had been published when the first one arrived; they are lost. Start the '
                'recording when the nodes run')

    def reset(self) -> None:
        """Ignore the gap before the next message: nobody was subscribed in between."""
        self._last_ns = None

    def add(self, stamp_ns: int, covered_ns: int = 0) -> None:
        """Count the messages lost before the one with this stamp, ns; covered_ns: duration of the samples in it, ns, 0 for messages at a
        fixed rate. A stamp before the last one starts a new sequence."""
        last_ns, end_ns = self._last_ns, self._end_ns
        self._last_ns, self._end_ns = stamp_ns, stamp_ns + covered_ns
        step = 0 if last_ns is None else stamp_ns - last_ns
        if not DRIVER.min_interval_ns <= step <= DRIVER.max_gap_ns:
            return
        self._steps.append(step)
        self._count += 1
        if self._count % DRIVER.messages_per_update == 0:
            known, self._period = self._period, float(sorted(self._steps)[int(DRIVER.short_share * len(self._steps))])
            if not known and not covered_ns:  # the loss before, as while the receiver took up its work, is no news
                self.lost += sum(max(round(before / self._period) - 1, 0) for before in list(self._steps)[:-1])
        if not self._period:
            return
        missing = max(round((stamp_ns - (end_ns if end_ns > last_ns else last_ns + self._period)) / self._period), 0)
        self.lost += missing
        self._missing.append(missing)

    @property
    def warning(self) -> str:
        """Warning if more than TOLERATED_LOSSES of the latest messages were lost, else ''."""
        lost = sum(self._missing)
        if lost <= TOLERATED_LOSSES:
            return ''
        share = 100 * lost / (lost + len(self._missing))
        return (f'{share:.0f} % of {self._topic} are missing according to the gaps in its stamps: the publisher or the recording omits '
                'them, or the transport loses them; check that the publisher is reliable, and the load of the machine and the network')
