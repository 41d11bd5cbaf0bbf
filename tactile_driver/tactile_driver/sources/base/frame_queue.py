# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a capture has read and nobody has taken yet: the newest of a live source, none of them old."""
from __future__ import annotations

import math
import time
from collections import deque

_LONGEST_S = 0.05  # that a frame may wait while there are younger ones, where that lasts: a queue is not built
_HICCUP_S = 1.0  # what ends within this time is a hiccup of the machine, and is worked off
_WINDOW_S = 4.0
_RECENT = 2000


class FrameQueue:
    """Up to keep frames; not safe against threads. left_out: how many frames went out of it untaken; waited_s: how long the one that was
    taken last had been in it."""

    def __init__(self, keep: int):
        self._keep = keep
        self._frames: deque[tuple[float, object]] = deque()
        self.left_out, self.waited_s = 0, 0.0
        self._late_s = self._last_late_s = -math.inf  # since when, and when for the last time, frames waited too long
        self._passed: deque[tuple[float, bool]] = deque(maxlen=_RECENT)  # monotonic s, whether it was taken

    def __len__(self) -> int:
        return len(self._frames)

    def add(self, frame: object) -> None:
        """A frame has come; the oldest make room for it."""
        while len(self._frames) >= self._keep:
            self._leave_out()
        self._frames.append((time.monotonic(), frame))

    def take(self) -> object | None:
        """The oldest frame, None where there is none; where late frames are no hiccup, the oldest that is not late, or the newest."""
        now = time.monotonic()
        while self._is_late(now) and now - self._late_s > _HICCUP_S:
            self._leave_out()
        if not self._frames:
            return None
        self._passed.append((now, True))
        came, frame = self._frames.popleft()
        self.waited_s = now - came
        return frame

    def _is_late(self, now: float) -> bool:
        """Whether the oldest has waited too long."""
        late = len(self._frames) > 1 and now - self._frames[0][0] > _LONGEST_S
        if late:
            self._late_s = now if now - self._last_late_s > _HICCUP_S else self._late_s
            self._last_late_s = now
        return late

    def clear(self) -> None:
        """Forget what waits."""
        self._frames.clear()

    @property
    def share_left_out(self) -> float:
        """Of the frames of the last seconds, 0 to 1."""
        now = time.monotonic()
        recent = [taken for passed, taken in self._passed if now - passed < _WINDOW_S]
        return recent.count(False) / len(recent) if recent else 0.0

    def _leave_out(self) -> None:
        self._frames.popleft()
        self.left_out += 1
        self._passed.append((time.monotonic(), False))
