# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a processing node has done: counts, rate, time per frame, latency, for /diagnostics and the log."""
from __future__ import annotations

import math
import time
from collections import deque
from statistics import median

from tactile_driver.nodes.runtime.diagnostics import ERROR, OK, WARN, Health, common_values
from tactile_driver.stamp_gaps import StampGaps

_RECENT = 120
_SILENCE_S, _WINDOW_S = 2.0, 4.0
_FEW = 3  # so many left out, or refused, within the window are no news: the machine did something else for a moment


class WorkLog:
    """Counts frames as they are done, refused, left out or lost on their way; topic: what is processed, for the messages."""

    def __init__(self, topic: str):
        self._topic, self._gaps = topic, StampGaps(topic)
        self.done = self.refused = self.shed = 0
        self.last_error = ''
        self._in_error = False
        self._stamps: deque[float] = deque(maxlen=_RECENT)
        self._left_out: deque[float] = deque(maxlen=_RECENT)
        self._bad: deque[float] = deque(maxlen=_RECENT)
        self._seconds: deque[float] = deque(maxlen=_RECENT)
        self._latencies: deque[float] = deque(maxlen=_RECENT)

    def add(self, seconds: float, latency: float) -> None:
        """A frame was done in so many s, so many s after its stamp."""
        self.done += 1
        self._in_error = False
        self._stamps.append(time.monotonic())
        self._seconds.append(seconds)
        self._latencies.append(latency)

    def leave_out(self) -> None:
        """A frame had waited so long that it was left out."""
        self.shed += 1
        self._left_out.append(time.monotonic())

    def arrive(self, stamp_ns: int, covered_ns: int = 0) -> None:
        """A frame with this stamp has come, whose samples take covered_ns (0: frames come at a fixed rate)."""
        self._gaps.add(stamp_ns, covered_ns)

    def listen_anew(self) -> None:
        """What was sent up to now is not missing: nobody listened."""
        self._gaps.restart()

    def refuse(self, error: str) -> None:
        """A frame could not be used."""
        self.refused += 1
        self._bad.append(time.monotonic())
        self.last_error = error
        self._in_error = True

    @property
    def age(self) -> float:
        """Time since the last frame was done, s; NaN before the first."""
        return time.monotonic() - self._stamps[-1] if self._stamps else math.nan

    @property
    def rate(self) -> float:
        """Frames done per second, lately; NaN until known."""
        recent = _recent(self._stamps)
        return (len(recent) - 1) / (recent[-1] - recent[0]) if len(recent) > 2 else math.nan

    def health(self, idle: bool, remark: str = '', values: dict | None = None) -> Health:
        """For /diagnostics; idle: nobody subscribes; remark: something to warn of; values: more of them."""
        middle = {'time per frame (ms)': self._seconds, 'latency (ms)': self._latencies}
        shown = {**common_values('idle' if idle else 'running', self.rate, self.age, self.shed), 'frames': self.done,
                 'lost frames': self._gaps.lost, 'refused frames': self.refused,
                 **{name: 1e3 * median(list(kept)) if kept else math.nan for name, kept in middle.items()},
                 'last error': self.last_error, **(values or {})}
        return Health(*self._judged(idle, remark), shown)

    def _judged(self, idle: bool, remark: str) -> tuple[bytes, str]:
        if idle:
            return OK, 'idle: nobody subscribes'
        if self._in_error:
            return ERROR, self.last_error
        if not self.done or self.age > _SILENCE_S:
            return WARN, f'nothing comes on {self._topic}: is its publisher running and active?'
        remark = self._gaps.remark or remark
        shed, bad, done = (len(_recent(times)) for times in (self._left_out, self._bad, self._stamps))
        if bad > _FEW:
            remark = f'{100 * bad / (bad + done):.0f} % of {self._topic} is refused: {self.last_error}'
        if shed > _FEW:
            share = 100 * shed / (shed + done)
            remark = (f'{share:.0f} % of {self._topic} is left out: this machine is too slow; lower the rate, choose a faster method '
                      'or end what else it does')
        return (WARN, remark) if remark else (OK, f'{self.rate:.1f} Hz')


def _recent(times: deque[float]) -> list[float]:
    """Those of the last seconds."""
    now = time.monotonic()
    return [t for t in times if now - t < _WINDOW_S]
