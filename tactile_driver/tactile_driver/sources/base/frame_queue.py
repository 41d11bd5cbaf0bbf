# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The queue between a capture and its consumer: the newest frames of a live source, none of them old."""
from __future__ import annotations

import math
import time
from collections import deque

_LONGEST_S = 0.05  # a frame that waits longer while newer ones exist is late; chosen
_HICCUP_S = 1.0  # frames that are late for less are still delivered; chosen
_WINDOW_S = 4.0  # span of share_left_out; chosen
_RECENT = 2000  # frames: over _WINDOW_S at 500 Hz


class FrameQueue:
    """Up to keep frames; not thread-safe. left_out: number of frames skipped; waited_s: waiting time of the last frame taken, s."""

    def __init__(self, keep: int):
        self._keep = keep
        self._frames: deque[tuple[float, object]] = deque()
        self.left_out, self.waited_s = 0, 0.0
        self._late_s = self._last_late_s = -math.inf  # first and last time that frames were late
        self._passed: deque[tuple[float, bool]] = deque(maxlen=_RECENT)  # monotonic s, whether it was taken

    def __len__(self) -> int:
        return len(self._frames)

    def add(self, frame: object) -> None:
        """Append a frame; the oldest ones make room for it."""
        while len(self._frames) >= self._keep:
            self._leave_out()
        self._frames.append((time.monotonic(), frame))

    def take(self) -> object | None:
        """The oldest frame, None if there is none. If frames have been late for long: the oldest that is not late, or the newest."""
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
        """Whether the oldest frame is late."""
        late = len(self._frames) > 1 and now - self._frames[0][0] > _LONGEST_S
        if late:
            self._late_s = now if now - self._last_late_s > _HICCUP_S else self._late_s
            self._last_late_s = now
        return late

    def clear(self) -> None:
        """Drop all frames."""
        self._frames.clear()

    @property
    def share_left_out(self) -> float:
        """Share of the last seconds' frames that were skipped, 0 to 1."""
        now = time.monotonic()
        recent = [taken for passed, taken in self._passed if now - passed < _WINDOW_S]
        return recent.count(False) / len(recent) if recent else 0.0

    def _leave_out(self) -> None:
        self._frames.popleft()
        self.left_out += 1
        self._passed.append((time.monotonic(), False))
