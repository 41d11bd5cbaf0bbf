# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Pairs the frames of two cameras by their stamps."""
from __future__ import annotations

from collections import deque

import numpy as np

from ..base.shutter_offset import ShutterOffset
from ...frame import Frame, PairFrame

LEFT, RIGHT = 0, 1
_LONGEST_QUEUE = 8  # frames of one camera that may wait for their counterparts; chosen
_INTERVALS, _FEWEST_INTERVALS = 30, 4  # latest intervals that determine the period; how many are needed; chosen
_SHORT = 20  # percentile of the intervals used as the period, below the median because lost frames lengthen intervals; chosen
_BEGIN_ANEW_NS = 1_000_000_000  # a stamp further back than this restarts the pairing; chosen
_HYSTERESIS = 0.1  # frame periods by which offsets may exceed one half before frames pair in the other way; chosen: jitter is less


class Pairer:
    """Pairs each frame with the nearest one of the other camera, at most max_skew_ns, ns, and half a frame period away.

    max_skew_ns: negative for half a period. At a skew beyond half a period an adjacent frame would match better, and that frame may be late
    or lost. So no pair is formed before the period is known. Near half a period, where jitter would pair a frame now with the one before
    and now with the one after it, a hysteresis keeps the order of the last pair. nominal_ns: period reported by the cameras, ns, None if
    unknown; the period is measured as well. unpaired: number of frames without a counterpart or out of order; shutters: offset of the
    nearest frames, also where it is beyond max_skew_ns.
    """

    def __init__(self, max_skew_ns: int, nominal_ns: float | None = None):
        self.unpaired = 0
        self._max_skew, self._nominal = max_skew_ns if max_skew_ns >= 0 else np.inf, nominal_ns
        self.shutters = ShutterOffset(self._max_skew)
        self._skew = 0  # ns, of the last nearest frames
        self._queues: tuple[deque[Frame], deque[Frame]] = deque(), deque()
        self._intervals = deque(maxlen=_INTERVALS), deque(maxlen=_INTERVALS)
        self._last: list[int | None] = [None, None]

    def add(self, side: int, frame: Frame) -> None:
        """Add the next frame of one camera (0 left, 1 right). A stamp that goes back by over a second restarts the pairing."""
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
        """Number of frames of one camera that wait for their counterparts."""
        return len(self._queues[side])

    def take(self, last: bool = False) -> PairFrame | None:
        """The next pair, or None; last: no more frames will arrive, so do not wait for the period."""
        left, right = self._queues
        while left and right:
            if not self._knows_period and not last:
                return None
            skew = right[0].stamp_ns - left[0].stamp_ns
            if self._are_nearest(skew):
                self._skew = skew
                self.shutters.add(left[0].stamp_ns, right[0].stamp_ns, self.period_ns or np.inf)
                if abs(skew) <= self._max_skew:
                    return PairFrame(left[0], right.popleft(), left.popleft().truth)
            self._drop(LEFT if skew > 0 else RIGHT)
        return None

    def _are_nearest(self, skew: int) -> bool:
        """Whether no adjacent frame matches better than one with this skew, ns."""
        period = self.period_ns
        return period is None or abs(skew - np.sign(self._skew) * _HYSTERESIS * period) <= period / 2

    def take_single(self, side: int) -> PairFrame | None:
        """The next frame of one camera as an incomplete pair, or None; used while the other camera is lost."""
        if not self._queues[side]:
            return None
        frame = self._queues[side].popleft()
        return PairFrame(frame, None) if side == LEFT else PairFrame(None, frame)

    def forget(self) -> None:
        """Discard the waiting frames without counting them as unpaired: they are not wanted."""
        for queue in self._queues:
            queue.clear()

    def clear(self) -> None:
        """Discard the waiting frames and count them as unpaired."""
        for side in (LEFT, RIGHT):
            while self._queues[side]:
                self._drop(side)

    @property
    def period_ns(self) -> float | None:
        """Frame period, ns: the shortest of the nominal and the measured periods; None if unknown."""
        seen = [float(np.percentile(intervals, _SHORT)) for intervals in self._intervals if intervals]
        return min([*seen, *([self._nominal] if self._nominal else [])], default=None)

    @property
    def _knows_period(self) -> bool:
        return bool(self._nominal) or max(map(len, self._intervals)) >= _FEWEST_INTERVALS

    def _drop(self, side: int) -> None:
        self._queues[side].popleft()
        self.unpaired += 1
