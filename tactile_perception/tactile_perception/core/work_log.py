# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The load of a processing node: which messages it drops where it is too slow, so that its results stay recent, and its statistics for
/diagnostics: counts, rate, time per frame, latency."""
from __future__ import annotations

import math
import time
from collections import deque

from tactile_driver.nodes.health import MISSED
from tactile_driver.nodes.runtime.diagnostics import ERROR, OK, WARN, Health, common_values
from tactile_driver.sources.constants import SOURCES
from tactile_driver.sources.source import NS
from tactile_driver.stamp_gaps import RECENT_MESSAGES, SAME_CLOCK_S, TOLERATED_LOSSES, StampGaps

from .constants import CORE


class Shedding:
    """Decides from the times of reception which messages are too late to be processed; longest_s: that a message may wait, s."""

    def __init__(self, longest_s: float = CORE.max_wait_s):
        self._longest_s = longest_s
        self._last: tuple[int, int] | None = None
        self._steps = [0.0, 0.0]  # s, mean periods of reception and of stamps

    def is_late(self, stamp_ns: int, received_ns: int, now_ns: int) -> bool:
        """Whether to drop, at now_ns, a message stamped stamp_ns and received at received_ns (same clock as now_ns; 0: not known)."""
        if not received_ns:
            return False
        if self._last is not None:
            steps_ns = received_ns - self._last[0], stamp_ns - self._last[1]
            if min(steps_ns) > 0:  # else a clock was set back
                steps = [min(step / NS, 1.0) for step in steps_ns]
                self._steps = [old + CORE.period_smoothing * (new - old) if old else new for old, new in zip(self._steps, steps)]
        self._last = received_ns, stamp_ns
        received_s, stamped_s = self._steps
        longest_s = max(self._longest_s, CORE.max_wait_periods * received_s)
        return received_s > CORE.played_fast * stamped_s and (now_ns - received_ns) / NS > longest_s


class WorkLog:
    """Counts frames that were processed, refused, dropped by load shedding, or lost in transport.

    topic: of the frames, for the texts; by_call: whether a node of the same process publishes them, which then reports itself that it does
    not.
    """

    def __init__(self, topic: str, by_call: bool = False):
        self._topic, self._by_call, self._gaps = topic, by_call, StampGaps(topic)
        self.done = self.refused = self.shed = 0
        self.last_error = ''
        self._in_error = False
        self._stamps: deque[float] = deque(maxlen=RECENT_MESSAGES)
        self._dropped: deque[float] = deque(maxlen=RECENT_MESSAGES)
        self._bad: deque[float] = deque(maxlen=RECENT_MESSAGES)
        self._seconds: deque[float] = deque(maxlen=RECENT_MESSAGES)
        self._latencies: deque[float] = deque(maxlen=RECENT_MESSAGES)

    def add(self, seconds: float, latency: float) -> None:
        """Count a frame that was processed in seconds, with latency s after its stamp; a latency of more than a minute is of another clock
        and not known."""
        self.done += 1
        self._in_error = False
        self._stamps.append(time.monotonic())
        self._seconds.append(seconds)
        self._latencies.append(latency if abs(latency) < SAME_CLOCK_S else math.nan)

    def drop(self) -> None:
        """Count a frame that was dropped because it had waited too long."""
        self.shed += 1
        self._dropped.append(time.monotonic())

    def arrive(self, stamp_ns: int, covered_ns: int = 0) -> None:
        """Count the frames lost before this one; its samples last covered_ns (0: frames come at a fixed rate). None is lost in a call."""
        if not self._by_call:
            self._gaps.add(stamp_ns, covered_ns)

    def begin(self, missed: int) -> None:
        """Note the number of frames that were published before the first one arrived."""
        self._gaps.begin(missed)

    @property
    def note(self) -> str:
        """What was lost of a recording before the first frame arrived, '' for nothing."""
        return self._gaps.note

    def restart_gaps(self) -> None:
        """Do not count what was sent before now as lost: this node was not subscribed."""
        self._gaps.reset()

    def refuse(self, error: str) -> None:
        """Count a frame that could not be used; error: why."""
        self.refused += 1
        self._bad.append(time.monotonic())
        self.last_error = error
        self._in_error = True

    @property
    def refuses(self) -> bool:
        """Whether the newest frame was refused, a moment ago."""
        return self._in_error and time.monotonic() - self._bad[-1] <= CORE.silence_s

    @property
    def age(self) -> float:
        """Time since the last frame was processed, s; NaN before the first."""
        return time.monotonic() - self._stamps[-1] if self._stamps else math.nan

    @property
    def rate(self) -> float:
        """Recent frames per second; NaN until known."""
        recent = _recent(self._stamps)
        return (len(recent) - 1) / (recent[-1] - recent[0]) if len(recent) > 2 else math.nan

    def health(self, idle: bool, warning: str = '', values: dict | None = None) -> Health:
        """The Health for /diagnostics; idle: nobody subscribes; warning: '' for none; values: name -> value to add."""
        middle = {'time per frame (ms)': self._seconds, 'latency (ms)': self._latencies}
        shown = {**common_values('idle' if idle else 'running', self.rate, self.age, self.shed), 'frames': self.done,
                 'lost frames': self._gaps.lost, MISSED: self._gaps.missed, 'refused frames': self.refused,
                 **{name: 1e3 * _middle(kept) for name, kept in middle.items()},
                 'stamps': self._reported_of_stamps(), 'last error': self.last_error, **(values or {})}
        return Health(*self._judged(idle, warning), shown)

    def _reported_of_stamps(self) -> str:
        if not self._latencies:
            return ''
        if math.isnan(self._latencies[-1]):
            return 'of another clock than this node (of a recording, say): latency is not known'
        return 'of the clock of this node'

    def _judged(self, idle: bool, warning: str) -> tuple[bytes, str]:
        if idle:
            return OK, 'idle: nobody subscribes'
        if self._in_error:
            return ERROR, self.last_error
        if not self.done or self.age > CORE.silence_s:
            if self._by_call:
                return OK, f'waiting for {self._topic}'
            return WARN, f'no message on {self._topic}; check that its publisher is running and active'
        warning = self._gaps.warning or warning
        shed, bad, done = (len(_recent(times)) for times in (self._dropped, self._bad, self._stamps))
        if bad > TOLERATED_LOSSES:
            warning = f'{100 * bad / (bad + done):.0f} % of {self._topic} is refused: {self.last_error}'
        if shed > TOLERATED_LOSSES:
            share = 100 * shed / (shed + done)
            warning = (f'{share:.0f} % of {self._topic} is dropped: this machine is too slow; lower the rate, choose a faster method '
                      'or end other programs')
        return (WARN, warning) if warning else (OK, f'{self.rate:.1f} Hz')


def _middle(seconds: deque[float]) -> float:
    """The median of the known ones; NaN without any."""
    known = sorted(value for value in list(seconds) if not math.isnan(value))
    return known[len(known) // 2] if known else math.nan


def _recent(times: deque[float]) -> list[float]:
    """The times within the window."""
    now = time.monotonic()
    return [t for t in times if now - t < SOURCES.window_s]
