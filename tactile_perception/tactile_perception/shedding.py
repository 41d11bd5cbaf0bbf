# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Load shedding: which messages a node that is too slow drops, so that its results stay recent. No ROS here."""
from __future__ import annotations

LONGEST_S = 0.05  # that a message may wait: chosen; a short load of the machine is caught up, no lasting queue builds up
_PERIODS = 2  # that a message may wait, if longer than LONGEST_S: after two periods a newer one has arrived
_FASTER = 0.5  # ratio of periods, received to stamped: below it a recording is played fast, and no message is dropped; chosen
_SMOOTHING = 0.1  # of the periods, exponential: chosen, ten messages
_NS = 1e-9


class Shedding:
    """Decides from the times of reception which messages are too late to be processed; longest_s: that a message may wait, s."""

    def __init__(self, longest_s: float = LONGEST_S):
        self._longest_s = longest_s
        self._last: tuple[int, int] | None = None
        self._steps = [0.0, 0.0]  # s, mean periods of reception and of stamps

    def is_late(self, stamp_ns: int, received_ns: int, now_ns: int) -> bool:
        """Whether to drop, at now_ns, a message stamped stamp_ns and received at received_ns (same clock as now_ns; 0: not known)."""
        if not received_ns:
            return False
        if self._last is not None:
            self._follow(received_ns - self._last[0], stamp_ns - self._last[1])
        self._last = received_ns, stamp_ns
        received_s, stamped_s = self._steps
        return received_s > _FASTER * stamped_s and _NS * (now_ns - received_ns) > max(self._longest_s, _PERIODS * received_s)

    def _follow(self, *steps_ns: int) -> None:
        if min(steps_ns) > 0:  # a clock was set back
            steps = [min(_NS * step, 1.0) for step in steps_ns]
            self._steps = [old + _SMOOTHING * (new - old) if old else new for old, new in zip(self._steps, steps)]
