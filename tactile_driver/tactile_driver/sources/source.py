# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What all sources share: their base class, the time of stamps, recordings played at their pace, and scenes in real time."""
from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from ..errors import BadArgument
from ..frame import CameraCalibration, Frame, PairFrame
from .constants import SOURCES

Clock = Callable[[], int]


class EndOfSource(Exception):
    """The recording is over. This is not an error."""


class NothingYet(Exception):
    """Nothing has arrived for a moment. This is not an error: read again."""


class Source:
    """Raw data of a sensor, live or recorded.

    A subclass is made of the driver's parameters (a mapping) and of its clock, a function that returns the time for the stamps in ns.

    Attributes
    ----------
    live : bool
        Whether the sensor runs whether it is read or not, so that only its newest frames matter. A recording waits and loses nothing.
    on_demand : bool
        Whether the source has no rate of its own and is read only while frames are wanted.
    skipped : int
        Number of frames that were due but not produced.
    corrupt : int
        Number of frames that cannot be used.
    warning : str
        Warning about the data; empty for none.
    note : str
        Text to be logged once; empty for none.
    truths : tuple of str
        Topics below ``ground_truth/`` for which the frames have data, known once the source is open.
    """

    live = on_demand = False
    skipped = corrupt = 0
    warning = note = ''
    truths: tuple[str, ...] = ()

    def open(self) -> None:
        """Open the source at its start; may be called again after `close`.

        Raises
        ------
        DeviceLost
            If the device does not exist or cannot be opened.
        BadRecording
            If the recording is missing, empty or unreadable.
        BadArgument
            If a parameter is wrong.
        """
        raise NotImplementedError

    def read(self, wanted: bool = True) -> Frame | PairFrame | None:
        """Wait for the next frame.

        Parameters
        ----------
        wanted : bool
            Whether the frame is needed. Skipping a frame costs less than decoding it.

        Returns
        -------
        Frame, PairFrame, SampleBlock or None
            The frame; None if it is not wanted.

        Raises
        ------
        EndOfSource
            At the end of a recording.
        NothingYet
            After a moment without a frame.
        DeviceLost
            If the device has stopped or was unplugged.
        BadFrame
            If the frame cannot be used.
        """
        raise NotImplementedError

    def close(self) -> None:
        """Release the device or file. Closing a source that is not open does nothing."""

    def describe(self) -> dict:
        """Describe the source, for the topic ``description``.

        Returns
        -------
        dict
            Plain values: device or path, serial number, width and height in px, rate in Hz, and others, as far as they are known.
        """
        raise NotImplementedError

    def calibrations(self) -> tuple[CameraCalibration | None, ...]:
        """Calibrations of the cameras, valid once the source is open.

        Returns
        -------
        tuple of CameraCalibration or None
            Calibration of the camera, or of the left and the right camera; None where it is unknown.
        """
        return None, None

    def set_controls(self, values: Mapping[str, float]) -> None:
        """Set controls of a camera. Other sources ignore them.

        Parameters
        ----------
        values : Mapping
            Names of ``camera.v4l2.CONTROLS`` to their values.
        """


NS = 1_000_000_000
FIRST_S = 1.0  # stamp of the first frame without a clock: much of ROS takes a stamp of zero for an unknown time


def stamp_of(captured_ns: int, clock: Clock) -> int:
    """Convert a time of the monotonic clock to a stamp.

    Parameters
    ----------
    captured_ns : int
        Time of an event on ``time.monotonic_ns()``.
    clock : callable
        Clock of the stamps. It is compared with the monotonic clock again if the machine was busy in between.

    Returns
    -------
    int
        Stamp in ns.
    """
    compared = []
    while not compared or (compared[-1][0] > SOURCES.max_comparison_ns and len(compared) < SOURCES.max_comparisons):
        before, now, after = time.monotonic_ns(), clock(), time.monotonic_ns()
        compared.append((after - before, now - (before + after) // 2))
    # Simulated time stands at 0 until its first message.
    return max(captured_ns + min(compared)[1], 0)


def natural_key(path: Path) -> list:
    """Sort key for the natural order of file names.

    Parameters
    ----------
    path : Path
        Path of a file.

    Returns
    -------
    list
        The key.

    Examples
    --------
    >>> [path.name for path in sorted(map(Path, ['frame_10', 'frame_2']), key=natural_key)]
    ['frame_2', 'frame_10']
    """
    return [(0, int(part), '') if part.isdigit() else (1, 0, part.lower()) for part in re.split(r'(\d+)', path.name) if part]


def wait_until(due_ns: int) -> None:
    """Sleep until a time of the monotonic clock.

    Parameters
    ----------
    due_ns : int
        Time on ``time.monotonic_ns()``.
    """
    left = due_ns - time.monotonic_ns()
    if left > 0:
        time.sleep(left / NS)


class EvenPace:
    """Due times at a fixed rate, without drift. A caller that is late by whole periods skips them, as with a camera.

    Parameters
    ----------
    rate : float
        Rate in Hz.

    Attributes
    ----------
    skipped : int
        Number of skipped periods.
    """

    def __init__(self, rate: float):
        self.skipped = self._count = 0
        self._period, self._origin = NS / rate, None

    def next(self) -> int:
        """Next due time; does not wait.

        Returns
        -------
        int
            Time on ``time.monotonic_ns()``.
        """
        now = time.monotonic_ns()
        self._origin = self._origin or now
        behind = max(int((now - self._origin) / self._period) - self._count, 0)
        self.skipped += behind
        due = self._origin + int((self._count + behind) * self._period)
        self._count += behind + 1
        return due


class PlayedSource(Source):
    """Base class of recordings. A subclass defines ``_items``, ``_recorded`` and ``_frame``.

    Parameters
    ----------
    values : Mapping
        Parameters of the driver: ``path``; ``rate`` in Hz, -1 for the recorded rate and 0 for as fast as frames are consumed; ``loop``,
        whether the recording restarts at its end.
    clock : callable
        Clock of the stamps, in ns.
    """

    def __init__(self, values: Mapping, clock: Clock):
        self.on_demand = values['rate'] == 0
        self._path, self.rate, self._loop, self._clock = Path(values['path']).expanduser(), values['rate'], values['loop'], clock
        self._playing, self._last = None, None  # of the last frame: recorded time, and due time or, on demand, stamp, ns
        self._step = 0  # ns, between the stamps of the last two frames on demand

    def open(self) -> None:
        """Open the recording at its start; see `Source.open`."""
        self.close()
        self._playing, self._last = self._items(), None

    def _items(self) -> Iterator:
        """Items for `_recorded`, from the start of the recording. Raises BadRecording."""
        raise NotImplementedError

    def _recorded(self, item) -> tuple[int, object]:
        """Time at which a frame was recorded, in ns (only intervals count), and the item for `_frame`. Raises BadFrame."""
        return 0, item

    def _frame(self, content, stamp_ns: int):
        """Make a frame with this stamp, which advances by the recorded intervals also if frames are consumed faster. Raises BadFrame."""
        raise NotImplementedError

    def read(self, wanted: bool = True):
        """Next frame, made ahead and returned when it is due; see `Source.read`."""
        item = next(self._playing, None) if self._playing is not None else None
        if item is None and self._playing is not None and self._loop:
            self._playing = self._items()
            item = next(self._playing, None)
        if item is None:
            raise EndOfSource(f'the recording {self._path} is over')
        recorded_ns, content = self._recorded(item)
        if self.on_demand:
            stamp = self._next_stamp(recorded_ns)
            return self._frame(content, stamp) if wanted else None
        due = self._due(recorded_ns)
        frame = self._frame(content, stamp_of(due, self._clock)) if wanted else None
        wait_until(due)
        return frame

    def _next_stamp(self, recorded_ns: int) -> int:
        """Stamp, ns, of a frame on demand. Where recorded time does not advance, as at a restart, the last interval is repeated."""
        if self._last is None:
            stamp = self._clock()
        else:
            step = recorded_ns - self._last[0]
            self._step = step if step > 0 else self._step
            stamp = self._last[1] + self._step if self._step else max(self._clock(), self._last[1] + 1)
        self._last = recorded_ns, stamp
        return stamp

    def _due(self, recorded_ns: int) -> int:
        """Due time of a frame, ns of time.monotonic_ns(). Where stamps jump, or the node was paused, time continues from now."""
        now, due = time.monotonic_ns(), -math.inf
        if self._last is not None:
            step = NS / self.rate if self.rate > 0 else recorded_ns - self._last[0]
            due = self._last[1] + step if 0 <= step <= SOURCES.max_gap_ns else due
        due = due if now - due < SOURCES.late_ns else now
        self._last = recorded_ns, due
        return round(due)

    def close(self) -> None:
        """Close the recording."""
        self._playing = None

    def describe(self) -> dict:
        """Path, rate in Hz (-1: as recorded), and whether the recording restarts; see `Source.describe`."""
        return {'path': str(self._path), 'rate': self.rate, 'loop': self._loop}


class SceneSource(Source):
    """Scene of a simulated sensor in real time. It restarts when it is over, and pauses while it is not wanted.

    A subclass defines ``sensor``, the sensor type; ``_open_scene(name, rate, seed)``; ``_make(number)``, which computes ``count`` steps of
    the scene from a step on; and ``_handed_over(made, due_ns)``, which returns them as data of the source, due at a time of the monotonic
    clock.

    Parameters
    ----------
    values : Mapping
        Parameters of the driver: ``scene``, its name; ``rate`` in Hz, -1 for `usual_rate`; ``seed`` of the noise and the specimen.
    clock : callable
        Clock of the stamps, in ns.

    Attributes
    ----------
    count : int
        Steps of the scene that one `read` returns.

    Raises
    ------
    BadArgument
        If the rate is 0.
    """

    truths = ('tip', 'contacts', 'contact_region', 'slip', 'wrench')
    live = True
    usual_rate = 30.0
    max_catch_up = 2  # steps computed at once after a delay; more would delay the next step
    count = 1
    sensor = ''

    def __init__(self, values: Mapping, clock: Clock):
        if values['rate'] == 0:
            raise BadArgument(f'rate: source sim runs in real time, so 0 is not allowed; give one in Hz, or -1 for {self.usual_rate:g} Hz')
        self.rate = values['rate'] if values['rate'] > 0 else self.usual_rate
        self._values, self._clock, self._scene, self._pace, self._number = values, clock, None, None, 0

    @property
    def skipped(self) -> int:
        """Number of steps that were skipped because their computation was late."""
        return self._pace.skipped * self.count if self._pace else 0

    def open(self) -> None:
        """Open the scene at its start. For an unknown scene, `BadArgument` lists the scenes."""
        self._scene = self._open_scene(self._values['scene'], self.rate, self._values['seed'])
        self._pace, self._number = EvenPace(self.rate / self.count), 0

    def read(self, wanted: bool = True):
        """Next step, computed ahead and returned when it is due; see `Source.read`."""
        skipped = self._pace.skipped
        due = self._pace.next()
        if not wanted:
            wait_until(due)
            return None
        # Skipped steps have to be computed too: catching up fully after a long stall would cause the next stall.
        self._number += self.count * min(self._pace.skipped - skipped, self.max_catch_up)
        made = self._make(self._number)
        self._number += self.count
        self._compute_ahead(due)
        wait_until(due)
        return self._handed_over(made, due)

    def close(self) -> None:
        """Close the scene."""
        self._scene = None

    def describe(self) -> dict:
        """Scene, seed and rate in Hz; see `Source.describe`."""
        return {'device': f'simulated {self.sensor}', 'scene': self._values['scene'], 'seed': self._values['seed'], 'rate': self.rate}

    def stamp(self, due_ns: int) -> int:
        """Stamp of what was due at a time of the monotonic clock.

        Parameters
        ----------
        due_ns : int
            Time on ``time.monotonic_ns()``.

        Returns
        -------
        int
            Stamp in ns.
        """
        return stamp_of(due_ns, self._clock)

    def _compute_ahead(self, due_ns: int) -> None:
        """Use the time until due_ns of the monotonic clock for later steps; does nothing where each step takes the same time."""
