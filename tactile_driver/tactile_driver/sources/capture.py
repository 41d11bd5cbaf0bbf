# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A thread that reads a source: the newest frames of a live one, every frame of a recording; it reopens a lost device."""
from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

from ..errors import BadFrame, DeviceLost, TactileError
from ..frame import Frame, PairFrame
from .constants import SOURCES
from .source import EndOfSource, NothingYet, Source


class FrameQueue:
    """Up to keep frames; not thread-safe without holding changed, which may be common to several queues and is notified of each frame.
    left_out: number of frames skipped; waited_s: waiting time of the last frame taken, s, by which those who work on it skip what is too
    old."""

    def __init__(self, keep: int = 1, changed: threading.Condition | None = None):
        self.changed = changed or threading.Condition()
        self.frames: deque[tuple[float, object]] = deque(maxlen=keep)  # monotonic s of arrival
        self.left_out, self.waited_s = 0, 0.0
        self._passed: deque[tuple[float, bool]] = deque(maxlen=SOURCES.recent_frames)  # monotonic s, whether it was taken

    def add(self, frame: object) -> None:
        """Append a frame; the oldest one makes room for it."""
        now = time.monotonic()
        if len(self.frames) == self.frames.maxlen:
            self.left_out += 1
            self._passed.append((now, False))
        self.frames.append((now, frame))

    def take(self) -> object | None:
        """The oldest frame, None if there is none."""
        if not self.frames:
            return None
        now = time.monotonic()
        self._passed.append((now, True))
        came, frame = self.frames.popleft()
        self.waited_s = now - came
        return frame

    @property
    def share_left_out(self) -> float:
        """Share of the last seconds' frames that were skipped, 0 to 1."""
        now = time.monotonic()
        recent = [taken for passed, taken in self._passed if now - passed < SOURCES.window_s]
        return recent.count(False) / len(recent) if recent else 0.0


@dataclass(frozen=True)
class CaptureStatus:
    """State and counts of a capture.

    state: running, paused, lost, ended or failed; received, dropped (not delivered), corrupt: numbers of frames; rate: as measured, Hz, NaN
    until known; age_s: since the newest frame, NaN before the first; error: message of the last failure, kept after recovery; failing:
    whether the newest frame could not be used; left_out: share of the last seconds' frames that were skipped because nobody took them.
    """

    state: str
    received: int
    dropped: int
    corrupt: int
    rate: float
    age_s: float
    error: str
    failing: bool = False
    left_out: float = 0.0


class Capture:
    """Reads an open source in a thread of its own.

    source: opened by the caller, closed by stop; subscribers: returns the number of those who want frames; report: called with (level
    'error' or 'info', text) on a failure and its end; queue: of the frames that wait to be taken, of a live source the newest ones; lost:
    why the source is not open yet, ''; settle: time, s, for which the number of subscribers must not have changed before a recording
    starts.
    """

    def __init__(self, source: Source, subscribers: Callable[[], int], report: Callable[[str, str], None],
                 queue: FrameQueue | None = None, lost: str = '', settle: float = 0.0):
        self._source, self._subscribers, self._report = source, subscribers, report
        self._settle, self._last_count, self._count_changed_s = settle, 0, -math.inf
        self._slot = queue or FrameQueue()
        self._changed = self._slot.changed
        self._stopped, self._active = threading.Event(), threading.Event()
        self._arrivals: deque[float] = deque(maxlen=SOURCES.rate_frames)
        self._status = CaptureStatus('lost' if lost else 'paused', 0, 0, 0, math.nan, math.nan, lost)
        self._bad, self._last_bad_s = 0, -math.inf
        self._sizes, self._begun, self._other_since_s = {}, False, None
        self._thread = threading.Thread(target=self._run, name='capture', daemon=True)
        self._thread.start()

    def resume(self) -> None:
        """Deliver frames from now on."""
        self._active.set()

    def pause(self) -> None:
        """Deliver nothing. A recording stands still; a live source is read on and its frames are dropped."""
        self._active.clear()
        with self._changed:
            self._slot.frames.clear()
            self._arrivals.clear()
            self._changed.notify_all()

    def stop(self) -> None:
        """End the thread and close the source."""
        self._stopped.set()
        with self._changed:
            self._changed.notify_all()
        self._thread.join(timeout=5.0)
        self._source.close()

    @property
    def ended(self) -> bool:
        """Whether the recording is over; its last frames may still wait."""
        return self._status.state == 'ended'

    @property
    def ready(self) -> bool:
        """Whether a frame waits."""
        return bool(self._slot.frames)

    def take(self, timeout: float) -> Frame | PairFrame | None:
        """The next frame, or None after timeout s without one."""
        with self._changed:
            self._changed.wait_for(lambda: self.ready or self._stopped.is_set(), timeout)
            frame = self._slot.take()
            self._changed.notify_all()
        return frame

    @property
    def waited_s(self) -> float:
        """Waiting time of the last frame taken, s."""
        return self._slot.waited_s

    @property
    def status(self) -> CaptureStatus:
        """The present state and counts."""
        with self._changed:
            arrivals, left_out, now = list(self._arrivals), self._slot.share_left_out, time.monotonic()
        # Only the last seconds count: the rate of a stopped camera falls to 0.
        recent = [t for t in arrivals if now - t < SOURCES.window_s]
        rate = (len(recent) - 1) / (recent[-1] - recent[0]) if len(recent) > 2 else 0.0 if arrivals else math.nan
        return replace(self._status, rate=rate, age_s=now - arrivals[-1] if arrivals else math.nan, left_out=left_out,
                       dropped=self._slot.left_out + self._source.skipped, corrupt=self._bad + self._source.corrupt)

    def _set(self, **changes) -> None:
        self._status = replace(self._status, **changes)

    def _run(self) -> None:
        while not self._stopped.is_set():
            if self._status.state == 'lost':
                self._reopen()
            elif self._status.state in ('ended', 'failed') or not self._due():
                self._stopped.wait(SOURCES.idle_s)
            else:
                self._read_one()

    def _due(self) -> bool:
        """Whether to read the source now."""
        active = self._active.is_set()
        self._set(state='running' if active else 'paused')
        count, now = self._subscribers() if active else 0, time.monotonic()
        if count != self._last_count:
            self._last_count, self._count_changed_s = count, now
        # A recording starts with its subscribers: the perception needs its untouched start as reference.
        self._begun = self._begun or (count > 0 and now - self._count_changed_s >= self._settle)
        return self._source.live or (active and self._begun and (count > 0 or not self._source.on_demand))

    def _read_one(self) -> None:
        try:
            frame = self._source.read(self._active.is_set() and self._subscribers() > 0)
            if frame is not None:
                self._check_size(frame)
        except NothingYet:
            return
        except EndOfSource as end:
            self._set(state='ended')
            self._report('info', str(end))
        except BadFrame as error:  # counted; the first of many is logged
            now = time.monotonic()
            if now - self._last_bad_s > SOURCES.log_again_s:
                self._report('error', str(error))
            self._bad, self._last_bad_s = self._bad + 1, now
            self._set(error=str(error), failing=True)
        except DeviceLost as error:
            self._failed(error, 'lost')
        except Exception as error:  # anything else would end the thread silently
            self._failed(error, 'failed')
        else:
            self._arrived(frame)

    def _failed(self, error: Exception, state: str) -> None:
        text = str(error) if isinstance(error, TactileError) else f'reading failed: {error!r}; clean up and configure again'
        self._report('error', text)
        self._set(error=text, state=state)

    def _check_size(self, frame: Frame | PairFrame) -> None:
        """Raise BadFrame for a frame of another size than the first, and DeviceLost if a live source sends only such frames: reopening sets
        the requested size again or adopts the camera's."""
        for view, size in frame.sizes.items():
            first = self._sizes.setdefault(view, size)
            if size != first:
                name = f'{view} frame' if view else 'frame'
                what = f'a {name} of {size[0]} x {size[1]} px among frames of {first[0]} x {first[1]} px'
                self._other_since_s = self._other_since_s or time.monotonic()
                if self._source.live and time.monotonic() - self._other_since_s > SOURCES.other_size_s:
                    raise DeviceLost(f'{what}, and no others any more; the device is opened again')
                raise BadFrame(f'{what}; it is skipped')
        self._other_since_s = None

    def _arrived(self, frame: Frame | PairFrame | None) -> None:
        with self._changed:
            self._arrivals.append(time.monotonic())
            self._set(received=self._status.received + 1, failing=False)
            self._changed.notify_all()
            if frame is None or not self._active.is_set():
                return
            if not self._source.live:
                self._changed.wait_for(lambda: not self.ready or self._stopped.is_set() or not self._active.is_set())
            self._slot.add(frame)
            self._changed.notify_all()

    def _reopen(self) -> None:
        if self._stopped.wait(SOURCES.retry_s):
            return
        try:
            self._source.open()
        except DeviceLost as error:
            self._set(error=str(error))
        except TactileError as error:
            self._failed(error, 'failed')
        else:
            self._sizes, self._other_since_s = {}, None
            self._set(state='running', failing=False)
            self._report('info', f'device is back: {self._source.describe()}')
