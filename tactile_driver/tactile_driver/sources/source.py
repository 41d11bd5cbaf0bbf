# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What all sources share: the class, the time of stamps, recordings at their pace, scenes in real time."""
from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from ..errors import BadArgument
from ..frame import CameraCalibration, Frame, PairFrame

Clock = Callable[[], int]


class EndOfSource(Exception):
    """The recording is over; not a failure."""


class NothingYet(Exception):
    """Nothing arrived for a moment; not a failure, read again."""


class Source:
    """A sensor, live or recorded, made of its driver's parameters and its clock, which returns the time for the stamps, ns.

    live: it runs whether it is read or not, and only its newest frames matter; a recording waits and loses nothing. on_demand: it has no
    rate of its own and is read only while frames are wanted. skipped: number of frames that were due but not produced; corrupt: number of
    unusable frames; warning: about the data, ''; note: to be logged once, ''; truths: what of ground_truth/* its frames have, known once
    it is open.
    """

    live = on_demand = False
    skipped = corrupt = 0
    warning = note = ''
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
        """Plain values for the description: device or path, serial, width, height (px), rate (Hz) and others, if known."""
        raise NotImplementedError

    def calibrations(self) -> tuple[CameraCalibration | None, ...]:
        """The calibrations of its camera, or of the left and the right one, None if unknown; valid once open."""
        return None, None

    def set_controls(self, values: Mapping[str, float]) -> None:
        """Set controls of a camera: names and values of camera.v4l2.CONTROLS; nothing elsewhere."""


NS = 1_000_000_000
_PROMPT_NS, _TRIES = 50_000, 4  # chosen: three clock reads take a few us on an idle machine


def stamp_of(captured_ns: int, clock: Clock) -> int:
    """The stamp, ns of clock, of an event at captured_ns of time.monotonic_ns(); the clocks are compared again if the machine was busy."""
    compared = []
    while not compared or (compared[-1][0] > _PROMPT_NS and len(compared) < _TRIES):
        before, now, after = time.monotonic_ns(), clock(), time.monotonic_ns()
        compared.append((after - before, now - (before + after) // 2))
    # Simulated time stands at 0 until its first message.
    return max(captured_ns + min(compared)[1], 0)


def natural_key(path: Path) -> list:
    """Sort key for natural order: frame_2 before frame_10."""
    return [(0, int(part), '') if part.isdigit() else (1, 0, part.lower()) for part in re.split(r'(\d+)', path.name) if part]


def wait_until(due_ns: int) -> None:
    """Sleep until due_ns on time.monotonic_ns()."""
    left = due_ns - time.monotonic_ns()
    if left > 0:
        time.sleep(left / NS)


class EvenPace:
    """Due times at a fixed rate, Hz, without drift. A caller that is late by whole periods skips them, as with a camera.

    skipped: number of them.
    """

    def __init__(self, rate: float):
        self.skipped = self._count = 0
        self._period, self._origin = NS / rate, None

    def next(self) -> int:
        """The next due time, ns of time.monotonic_ns(); does not wait."""
        now = time.monotonic_ns()
        self._origin = self._origin or now
        behind = max(int((now - self._origin) / self._period) - self._count, 0)
        self.skipped += behind
        due = self._origin + int((self._count + behind) * self._period)
        self._count += behind + 1
        return due


class PlayedSource(Source):
    """A recording. values: path; rate: Hz, -1: as recorded, 0: as fast as consumed; loop: restart at the end.

    Subclasses define _items, _recorded and _frame.
    """

    def __init__(self, values: Mapping, clock: Clock):
        self.on_demand = values['rate'] == 0
        self._path, self.rate, self._loop, self._clock = Path(values['path']).expanduser(), values['rate'], values['loop'], clock
        self._playing, self._last = None, None  # of the last frame: when it was recorded and when it was due, ns

    def open(self) -> None:
        """Open the recording at its start. Raises BadRecording if it is missing, empty or unreadable."""
        self.close()
        self._playing, self._last = self._items(), None

    def _items(self) -> Iterator:
        """What _recorded takes, from the start of the recording. Raises BadRecording."""
        raise NotImplementedError

    def _recorded(self, item) -> tuple[int, object]:
        """When a frame was recorded, ns (only intervals count), and what _frame takes. Raises BadFrame."""
        return 0, item

    def _frame(self, content, due_ns: int):
        """The frame, due at due_ns of time.monotonic_ns() (0: as fast as consumed). Raises BadFrame."""
        raise NotImplementedError

    def read(self, wanted: bool = True):
        """The next frame, made ahead and returned when it is due; None if not wanted. Raises EndOfSource, or BadFrame."""
        item = next(self._playing, None) if self._playing is not None else None
        if item is None and self._playing is not None and self._loop:
            self._playing = self._items()
            item = next(self._playing, None)
        if item is None:
            raise EndOfSource(f'{self._path} is over')
        recorded_ns, content = self._recorded(item)
        due = 0 if self.on_demand else self._due(recorded_ns)
        frame = self._frame(content, due) if wanted else None
        wait_until(due)
        return frame

    def _due(self, recorded_ns: int) -> int:
        """The due time of a frame, ns of time.monotonic_ns(). Where stamps jump, or the node was paused, time goes on from now."""
        now, due = time.monotonic_ns(), -math.inf
        if self._last is not None:
            step = NS / self.rate if self.rate > 0 else recorded_ns - self._last[0]
            due = self._last[1] + step if 0 <= step <= _LONGEST_GAP_NS else due
        due = due if now - due < _LATE_NS else now
        self._last = recorded_ns, due
        return round(due)

    def close(self) -> None:
        """Close the recording."""
        self._playing = None

    def describe(self) -> dict:
        """The path and the rate, Hz (-1: as recorded)."""
        return {'path': str(self._path), 'rate': self.rate, 'loop': self._loop}


_LONGEST_GAP_NS, _LATE_NS = 5 * NS, NS // 10  # chosen


class SceneSource(Source):
    """A scene of a simulated sensor in real time, again from its start when it is over.

    values: scene: its name; rate: Hz, or -1 for usual_rate; seed: of noise and specimen. count: steps of the scene per read. The scene
    stands still while it is not wanted. Raises BadArgument for a rate of 0. Subclasses define sensor, its type; _open_scene(name, rate,
    seed); _make(number), which computes count steps of the scene from that one on; and _handed_over(made, due_ns), what was made as the
    source's data, due at due_ns of the monotonic clock.
    """

    truths = ('tip', 'contacts', 'contact_region', 'slip', 'wrench')
    live = True
    usual_rate = 30.0
    longest_leap = 2  # steps caught up at once; chosen: computing more would delay the next one
    count = 1
    sensor = ''

    def __init__(self, values: Mapping, clock: Clock):
        if values['rate'] == 0:
            raise BadArgument(f'rate: source sim runs in real time, so 0 is not allowed; give one in Hz, or -1 for {self.usual_rate:g} Hz')
        self.rate = values['rate'] if values['rate'] > 0 else self.usual_rate
        self._values, self._clock, self._scene, self._pace, self._number = values, clock, None, None, 0

    @property
    def skipped(self) -> int:
        """Number of steps that were skipped because computing was late."""
        return self._pace.skipped * self.count if self._pace else 0

    def open(self) -> None:
        """Open the scene at its start. Raises BadArgument, listing the scenes, for an unknown one."""
        self._scene = self._open_scene(self._values['scene'], self.rate, self._values['seed'])
        self._pace, self._number = EvenPace(self.rate / self.count), 0

    def read(self, wanted: bool = True):
        """The next step, computed ahead and returned when due; None if it is not wanted."""
        skipped = self._pace.skipped
        due = self._pace.next()
        if not wanted:
            wait_until(due)
            return None
        # Skipped steps have to be computed too: catching up fully after a long stall would cause the next stall.
        self._number += self.count * min(self._pace.skipped - skipped, self.longest_leap)
        made = self._make(self._number)
        self._number += self.count
        self._compute_ahead(due)
        wait_until(due)
        return self._handed_over(made, due)

    def close(self) -> None:
        """Drop the scene."""
        self._scene = None

    def describe(self) -> dict:
        """The scene, its seed and rate."""
        return {'device': f'simulated {self.sensor}', 'scene': self._values['scene'], 'seed': self._values['seed'], 'rate': self.rate}

    def stamp(self, due_ns: int) -> int:
        """The stamp, ns, of what was due at due_ns of the monotonic clock."""
        return stamp_of(due_ns, self._clock)

    def _compute_ahead(self, due_ns: int) -> None:
        """Use the time until due_ns of the monotonic clock for later steps; nothing where each step takes the same time."""
