# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a capture has read and nobody has taken yet: the newest of a live source, none of them old."""
from __future__ import annotations

import time
from collections import deque

_LONGEST_S = 0.05  # that a frame may wait while there are younger ones: a hiccup is worked off, a lasting queue is not built
_WINDOW_S = 4.0
_RECENT = 2000


class Waiting:
    """Up to keep frames; not safe against threads. left_out: how many frames went out of it untaken."""

    def __init__(self, keep: int):
        self._keep = keep
        self._frames: deque[tuple[float, object]] = deque()
        self.left_out = 0
        self._passed: deque[tuple[float, bool]] = deque(maxlen=_RECENT)  # monotonic s, whether it was taken

    def __len__(self) -> int:
        return len(self._frames)

    def add(self, frame: object) -> None:
        """A frame has come; the oldest make room for it."""
        while len(self._frames) >= self._keep:
            self._leave_out()
        self._frames.append((time.monotonic(), frame))

    def take(self) -> object | None:
        """The oldest frame that has not waited too long, or else the newest; None where there is none."""
        now = time.monotonic()
        while len(self._frames) > 1 and now - self._frames[0][0] > _LONGEST_S:
            self._leave_out()
        if not self._frames:
            return None
        self._passed.append((now, True))
        return self._frames.popleft()[1]

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
