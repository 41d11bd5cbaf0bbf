# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which messages to leave out, so that a node that is too slow for them stays up to date. No ROS here."""
from __future__ import annotations

LONGEST_S = 0.05  # that a message may wait: a hiccup of the machine is worked off, a lasting queue is not built
_PERIODS = 2  # or so many periods, whichever is longer: then a younger one is surely there
_FASTER = 0.5  # a recording played so much faster than it was made, or more, is nobody's live view: each message counts
_SMOOTHING = 0.1
_NS = 1e-9


class Shedding:
    """Follows when messages are received; a node that takes too long leaves out every n-th, and does the others at most longest_s late."""

    def __init__(self, longest_s: float = LONGEST_S):
        self._longest_s = longest_s
        self._last: tuple[int, int] | None = None
        self._steps = [0.0, 0.0]  # s between messages, as they are received and as they are stamped

    def is_late(self, stamp_ns: int, received_ns: int, now_ns: int) -> bool:
        """Whether to leave out, at now_ns, a message stamped stamp_ns that was received at received_ns by the same clock; 0: not known."""
        if not received_ns:
            return False
        if self._last is not None:
            self._follow(received_ns - self._last[0], stamp_ns - self._last[1])
        self._last = received_ns, stamp_ns
        received_s, stamped_s = self._steps
        return received_s > _FASTER * stamped_s and _NS * (now_ns - received_ns) > max(self._longest_s, _PERIODS * received_s)

    def _follow(self, *steps_ns: int) -> None:
        if min(steps_ns) > 0:  # clocks that go back tell nothing
            steps = [min(_NS * step, 1.0) for step in steps_ns]
            self._steps = [old + _SMOOTHING * (new - old) if old else new for old, new in zip(self._steps, steps)]
