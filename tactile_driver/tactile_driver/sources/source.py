# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What all sources share: the class, the time of stamps, playback at a steady rate, scenes in real time."""
from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from ..errors import BadArgument
from ..frame import CameraCalibration, Frame, PairFrame

Clock = Callable[[], int]


class EndOfSource(Exception):
    """The recording is over; not a failure."""


class NothingYet(Exception):
    """Nothing arrived for a moment; not a failure, read again."""


class Source:
    """A sensor, live or recorded.

    live: it runs whether it is read or not, and only its newest frames matter; a recording waits and loses nothing. on_demand: it has no
    rate of its own and is read only while frames are wanted. skipped: number of frames that were due but not produced; corrupt: number of
    unusable frames; warning: about the data, ''; truths: what of ground_truth/* its frames have, known once it is open.
    """

    live = on_demand = False
    skipped = corrupt = 0
    warning = ''
    truths: tuple[str, ...] = ()

    def open(self) -> None:
        """Open at the start. Raises DeviceLost, BadRecording or BadArgument; may be called again after close."""
        raise NotImplementedError

    def read(self, wanted: bool = True) -> Frame | PairFrame | None:
        """Wait for the next frame; None if it is not wanted (skipping costs less than decoding).

        Raises EndOfSource at the end of a recording, DeviceLost, NothingYet after a moment without one, or BadFrame for an unusable one.
        """
        raise NotImplementedError

    def close(self) -> None:
        """Release the device or file; does nothing if it is not open."""

    def describe(self) -> dict:
        """Plain values for the description: source, device or path, serial, width, height (px), rate (Hz) and others, if known."""
        raise NotImplementedError

    def calibration(self) -> CameraCalibration | None:
        """The camera's calibration, None if unknown; valid once open."""
        return None

    def set_controls(self, values: Mapping[str, float]) -> None:
        """Set controls of a camera: names and values of camera.controls.CONTROLS; nothing elsewhere."""


NS = 1_000_000_000
_PROMPT_NS, _TRIES = 50_000, 4  # chosen: three clock reads take a few us on an idle machine


def stamp_of(captured_ns: int, clock: Clock) -> int:
    """The stamp, ns of clock, of an event at captured_ns of time.monotonic_ns()."""
    # Simulated time stands at 0 until its first message.
    return max(captured_ns + _between(clock), 0)


def _between(clock: Clock) -> int:
    """clock minus time.monotonic_ns(), ns; read again if the machine was busy in between."""
    best, offset = None, 0
    for _ in range(_TRIES):
        before, now, after = time.monotonic_ns(), clock(), time.monotonic_ns()
        if best is None or after - before < best:
            best, offset = after - before, now - (before + after) // 2
        if best < _PROMPT_NS:
            break
    return offset


def wait_until(due_ns: int) -> None:
    """Sleep until due_ns on time.monotonic_ns()."""
    left = due_ns - time.monotonic_ns()
    if left > 0:
        time.sleep(left / NS)


_LONGEST_GAP_NS = 5 * NS  # chosen


class EvenPace:
    """Due times at a fixed rate, Hz, without drift.

    skip: a caller that is late by whole periods skips them, as with a camera (skipped counts them); else the later due times shift, as with
    a recording.
    """

    def __init__(self, rate: float, skip: bool):
        self.skipped = 0
        self._period = NS / rate
        self._skip = skip
        self._origin = None
        self._count = 0

    def next(self, _stamp_ns: int = 0) -> int:
        """The next due time, ns of time.monotonic_ns(), whatever the recorded stamp; does not wait."""
        now = time.monotonic_ns()
        if self._origin is None:
            self._origin = now
        behind = int((now - self._origin) / self._period) - self._count
        if behind > 0 and self._skip:
            self._count += behind
            self.skipped += behind
        elif behind > 0:
            self._origin += int(behind * self._period)
        due = self._origin + int(self._count * self._period)
        self._count += 1
        return due


class StampPace:
    """Due times with the intervals of recorded stamps; shifted if the caller is late or the stamps jump by more than 5 s."""

    def __init__(self):
        self._last = None

    def next(self, stamp_ns: int) -> int:
        """The due time, ns of time.monotonic_ns(), of the frame stamped stamp_ns; does not wait."""
        now = time.monotonic_ns()
        due = now
        if self._last is not None and 0 <= stamp_ns - self._last[0] <= _LONGEST_GAP_NS:
            due = self._last[1] + stamp_ns - self._last[0]
        # Late by over 0.1 s (chosen; the node was paused): continue from here instead of catching up.
        due = due if now - due < NS // 10 else now
        self._last = stamp_ns, due
        return due


class SceneSource(Source):
    """A scene of a simulated sensor in real time, again from its start when it is over.

    scene: its name; rate: Hz, or -1 for usual_rate; seed: of noise and specimen; clock: ns for the stamps; count: steps of the scene per
    read. The scene stands still while it is not wanted. Subclasses define _open_scene, _make and _handed_over.
    """

    truths = ('tip', 'contacts', 'contact_region', 'slip', 'wrench')
    live = True
    usual_rate = 30.0
    longest_leap = 2  # steps caught up at once; chosen: computing more would delay the next one

    def __init__(self, scene: str, rate: float, seed: int, clock: Clock, count: int = 1):
        self.rate = self.rate_of(rate)
        self._name, self._seed, self._clock, self._count = scene, seed, clock, count
        self._scene = self._pace = None
        self._number = 0

    @classmethod
    def rate_of(cls, rate: float) -> float:
        """The rate, Hz, with usual_rate for -1. Raises BadArgument for 0."""
        if rate == 0:
            raise BadArgument(f'rate: source sim runs in real time, so 0 is not allowed; give one in Hz, or -1 for {cls.usual_rate:g} Hz')
        return rate if rate > 0 else cls.usual_rate

    @property
    def skipped(self) -> int:
        """Number of steps that were skipped because computing was late."""
        return self._pace.skipped * self._count if self._pace else 0

    def open(self) -> None:
        """Open the scene at its start. Raises BadArgument, listing the scenes, for an unknown one."""
        self._scene = self._open_scene()
        self._pace = EvenPace(self.rate / self._count, skip=True)
        self._number = 0

    def read(self, wanted: bool = True):
        """The next step, computed ahead and returned when due; None if it is not wanted."""
        skipped = self._pace.skipped
        due = self._pace.next()
        if not wanted:
            wait_until(due)
            return None
        # Skipped steps have to be computed too: catching up fully after a long stall would cause the next stall.
        self._number += self._count * min(self._pace.skipped - skipped, self.longest_leap)
        made = self._make(self._number)
        self._number += self._count
        self._compute_ahead(due)
        wait_until(due)
        return self._handed_over(made, due)

    def close(self) -> None:
        """Drop the scene."""
        self._scene = None

    def describe(self) -> dict:
        """The scene, its seed and rate."""
        return {'source': 'sim', 'device': 'simulated', 'scene': self._name, 'seed': self._seed, 'rate': self.rate}

    def _open_scene(self):
        raise NotImplementedError

    def _make(self, number: int):
        """Compute steps number to number + count of the scene."""
        raise NotImplementedError

    def _compute_ahead(self, due_ns: int) -> None:
        """Use the time until due_ns of the monotonic clock for later steps; nothing where each step takes the same time."""

    def _handed_over(self, made, due_ns: int):
        """The result of _make as the source's data, due at due_ns of the monotonic clock."""
        raise NotImplementedError

    def _stamp(self, due_ns: int) -> int:
        return stamp_of(due_ns, self._clock)
