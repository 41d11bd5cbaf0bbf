# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which frames of two cameras belong together, told by their stamps."""
from __future__ import annotations

from collections import deque

import numpy as np

from ...frame import Frame, PairFrame

LEFT, RIGHT = 0, 1
_LONGEST_QUEUE = 8
_INTERVALS, _FEWEST_INTERVALS = 30, 4
_SHORT = 20  # percentile of the intervals that is taken for the period: lost frames make many of them longer
_BEGIN_ANEW_NS = 1_000_000_000


class Pairer:
    """Pairs frames whose stamps differ by at most max_skew_ns, ns, and by less than half a frame's period.

    Over half a period the frame before or after is nearer, and may only be late, or lost: so nothing is paired before the period is known.
    nominal_ns: the period as the cameras state it, None where they do not; it is measured too. unpaired: frames that had no mate, or
    came out of order.
    """

    def __init__(self, max_skew_ns: int, nominal_ns: float | None = None):
        self.unpaired = 0
        self._max_skew, self._nominal = max_skew_ns, nominal_ns
        self._queues: tuple[deque[Frame], deque[Frame]] = deque(), deque()
        self._intervals = deque(maxlen=_INTERVALS), deque(maxlen=_INTERVALS)
        self._last: list[int | None] = [None, None]

    def add(self, side: int, frame: Frame) -> None:
        """Take the next frame of one camera (0 left, 1 right); stamps that go back by over a second begin anew."""
        last = self._last[side]
        if last is not None and frame.stamp_ns <= last:
            if last - frame.stamp_ns < _BEGIN_ANEW_NS:
                self.unpaired += 1
                return
            self.clear()
            self._last = [None, None]
        elif last is not None:
            self._intervals[side].append(frame.stamp_ns - last)
        self._last[side] = frame.stamp_ns
        self._queues[side].append(frame)
        if len(self._queues[side]) > _LONGEST_QUEUE:
            self._drop(side)

    def waiting(self, side: int) -> int:
        """How many frames of one camera wait for their mates."""
        return len(self._queues[side])

    def take(self, last: bool = False) -> PairFrame | None:
        """The next pair, None as long as there is none; last: nothing more will come."""
        left, right = self._queues
        while left and right:
            if not self._knows_period and not last:
                return None
            limit = min(self._max_skew, (self.period_ns or np.inf) / 2)
            skew = right[0].stamp_ns - left[0].stamp_ns
            if abs(skew) <= limit:
                return PairFrame(left.popleft(), right.popleft())
            self._drop(LEFT if skew > 0 else RIGHT)
        return None

    def take_single(self, side: int) -> PairFrame | None:
        """The next frame of one camera without a mate, for while the other one is lost."""
        if not self._queues[side]:
            return None
        frame = self._queues[side].popleft()
        return PairFrame(frame, None) if side == LEFT else PairFrame(None, frame)

    def forget(self) -> None:
        """Let go of what waits, since nobody wants it."""
        for queue in self._queues:
            queue.clear()

    def clear(self) -> None:
        """Let go of what waits: it has no mate."""
        for side in (LEFT, RIGHT):
            while self._queues[side]:
                self._drop(side)

    @property
    def period_ns(self) -> float | None:
        """Time between frames, ns, as stated or as seen lately, the shorter one; None where nothing is known of it."""
        seen = [float(np.percentile(intervals, _SHORT)) for intervals in self._intervals if intervals]
        return min([*seen, *([self._nominal] if self._nominal else [])], default=None)

    @property
    def _knows_period(self) -> bool:
        return bool(self._nominal) or max(map(len, self._intervals)) >= _FEWEST_INTERVALS

    def _drop(self, side: int) -> None:
        self._queues[side].popleft()
        self.unpaired += 1
