# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A taxel array: on a serial port, in a file without ROS (.npz, .npy, .csv), and simulated."""
from __future__ import annotations

import re
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from ..errors import BadArgument, BadRecording
from ..frame import Frame, matrix_frame
from ..simulation.taxel.scene import open_taxel_scene
from ..sources.source import NS, Clock, EndOfSource, EvenPace, SceneSource, Source, StampPace, stamp_of, wait_until
from .clock import DeviceClock
from .frames import MATRIX, BinaryReader, CountFrame, Expected
from .port import SerialSource

_DEAF_BYTES = 65536  # so many bytes without a frame mean a wrong size or baud rate; chosen


class TaxelSerialSource(SerialSource):
    """A taxel array. device: see serial_port.find_port; shape: (rows, columns); clock: ns for the stamps."""

    def __init__(self, device: str, baud: int, shape: tuple[int, int], clock: Clock):
        self._shape = shape
        super().__init__(device, baud, clock, _DEAF_BYTES)

    def _new_reader(self) -> BinaryReader:
        return BinaryReader(Expected(MATRIX, *self._shape), self._counts)

    def _begin(self) -> None:
        super()._begin()
        self._device_clock = DeviceClock()

    @property
    def skipped(self) -> int:
        """Number of frames lost in transmission."""
        return self._counts.missing

    def _poll(self) -> None:
        frames, arrived_ns = self._received()
        if frames:
            stamps = self._device_clock.to_host([frame.time_us for frame in frames], arrived_ns)
            self._ready = list(zip(frames, stamps))

    def _delivered(self, found: tuple[CountFrame, int]) -> Frame:
        frame, stamp_ns = found
        return matrix_frame(frame.values, self._shape, stamp_of(stamp_ns, self._clock), f'frame {frame.sequence}')

    def describe(self) -> dict:
        """The port and its error counts."""
        about = super().describe()
        return about | {'resets': about['resets'] + self._device_clock.resets}

    def _deafness(self) -> str:
        return f'bytes come from {self._port.path}, but no frames of {self._shape[0]} x {self._shape[1]}: check rows, columns and baud'


_RATE = 100.0  # Hz of a recording without times; that of the simulated array
_TIMES = {'t': 1.0, 'stamps': 1.0, 't_ms': 1e-3}  # name of the times in an .npz: their unit, s


class TaxelFileSource(Source):
    """path: .npz with an array (frames, rows, columns) and maybe times t, stamps (s) or t_ms; .npy with such an array; .csv, .tsv and
    .txt as of read_table.

    array: its name in an .npz with several; rate: Hz; -1: the recorded times (100 Hz without); 0: as fast as consumed; loop: restart at the
    end; shape: (rows, columns); clock: ns for the stamps.
    """

    def __init__(self, path: str, array: str, rate: float, loop: bool, shape: tuple[int, int], clock: Clock):
        if not path:
            raise BadArgument('path: source file needs a .npz, .npy, .csv, .tsv or .txt file')
        self.on_demand = rate == 0
        self._path, self._array, self._rate, self._loop, self._shape = Path(path).expanduser(), array, rate, loop, shape
        self._clock = clock
        self._values = self._times = self._pace = None
        self._next = 0

    def open(self) -> None:
        """Read the file. Raises BadRecording if it is missing, broken or holds no frames."""
        readers = {'.npz': self._read_npz, '.npy': lambda: (np.load(self._path), None),
                   **dict.fromkeys(('.csv', '.tsv', '.txt'), lambda: read_table(self._path, self._shape))}
        if self._path.suffix not in readers:
            raise BadRecording(f'path: {self._path} is none of {", ".join(readers)}')
        try:
            self._values, self._times = readers[self._path.suffix]()
        except (OSError, ValueError, BadZipFile) as error:
            raise BadRecording(f'path: {self._path} cannot be read: {error}') from error
        if self._values.ndim != 3 or not len(self._values) or self._values.dtype.kind not in 'uifb':
            raise BadRecording(f'path: {self._path} holds an array of shape {self._values.shape}; frames, rows, columns are needed')
        if self._times is not None and len(self._times) != len(self._values):
            raise BadRecording(f'path: {self._path} holds {len(self._values)} frames but {len(self._times)} times')
        self._pace = EvenPace(self._rate if self._rate > 0 else _RATE, skip=False) if self._rate > 0 or self._times is None else StampPace()
        self._next = 0

    def _read_npz(self) -> tuple[np.ndarray, np.ndarray | None]:
        with np.load(self._path) as stored:
            found = [name for name in stored.files if stored[name].ndim == 3]
            wanted = [name for name in found if self._array in ('', name)]
            if len(wanted) != 1:
                raise BadRecording(f'path: {self._path} holds the arrays {", ".join(found) or "none of frames"}; name one as topic')
            times = next((stored[name] * unit for name, unit in _TIMES.items() if name in stored.files), None)
            return stored[wanted[0]], times

    def read(self, wanted: bool = True) -> Frame | None:
        """The next frame, when it is due. Raises EndOfSource, or BadFrame for one that cannot be published."""
        if self._values is None or self._next >= len(self._values) and not self._loop:
            raise EndOfSource(f'{self._path} is over')
        self._next %= len(self._values)
        number, self._next = self._next, self._next + 1
        due = 0
        if not self.on_demand:
            due = self._pace.next(0 if self._times is None else round(float(self._times[number]) * NS))
            wait_until(due)
        if not wanted:
            return None
        stamp = stamp_of(due, self._clock) if due else self._clock()
        return matrix_frame(self._values[number], self._shape, stamp, f'frame {number} of {self._path}')

    def close(self) -> None:
        """Drop the data."""
        self._values = None

    def describe(self) -> dict:
        """The path and the rate (-1: as recorded)."""
        return {'source': 'file', 'path': str(self._path), 'topic': self._array, 'rate': self._rate, 'loop': self._loop}


# A recording as text: a frame a line or a row of taxels a line, with or without header and times.
_SEPARATORS = ';', '\t', ','  # in this order: a line with semicolons may have commas in its numbers
_TIME = re.compile(r'\W*(t|time|times|stamp|timestamp)(\W*_?\W*(s|sec|seconds|ms|us))?\W*', re.IGNORECASE)
_UNITS = {'ms': 1e-3, 'us': 1e-6}  # s


def read_table(path: Path, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray | None]:
    """Frames (N, rows, columns) of a text file in UTF-8, and their times (N,), s, or None; shape: (rows, columns).

    A line is a frame, row by row, or one row of taxels; a time may precede it, in s, or in ms or us if the header says so. Numbers are
    separated by commas, semicolons or tabs. Raises BadRecording with what was seen and what is expected.
    """
    header, table = _numbers(path)
    (rows, columns), wide = shape, table.shape[1]
    for lines, across in ((1, rows * columns), (rows, columns)):
        if wide in (across, across + 1) and len(table) % lines == 0:
            times = table[::lines, 0] * _unit(header) if wide > across else None
            if times is not None and not (np.diff(times) > 0).all():
                number = int(np.argmin(np.diff(times) > 0)) + 1
                raise BadRecording(f'path: {path}: the times in the first column do not increase at frame {number}')
            return table[:, wide - across:].reshape(-1, *shape), times
    raise BadRecording(f'path: {path} has {len(table)} lines of {wide} numbers{" after a header" if header else ""}; expected for {rows} x '
                       f'{columns} taxels: {rows * columns} a line (a frame), or {columns} a line and {rows} lines a frame, and one more '
                       'where a time precedes them. Set rows and columns to those of the array')


def _numbers(path: Path) -> tuple[list[str], np.ndarray]:
    """The header's names, [] without one, and the numbers (lines, columns) of a file."""
    text = path.read_text(encoding='utf-8-sig')
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip() and not line.lstrip().startswith('#')]
    separator = next((mark for mark in _SEPARATORS if any(mark in line for _, line in lines[:3])), None)
    header, table = [], []
    for number, line in lines:
        fields = [field.strip() for field in line.strip(' \r').rstrip(separator).split(separator)]
        try:
            table.append([float(field.replace(',', '.')) if separator == ';' else float(field) for field in fields])
        except ValueError as error:
            if table or header:
                raise BadRecording(f'path: {path}: line {number} is not of numbers ({error}); after one line of names, numbers are '
                                   'expected, separated by commas, semicolons or tabs') from error
            header = fields
            continue
        if len(table[-1]) != len(table[0]):
            raise BadRecording(f'path: {path}: line {number} has {len(table[-1])} numbers, those before it {len(table[0])}')
    if not table:
        raise BadRecording(f'path: {path} has no line of numbers')
    return header, np.array(table)


def _unit(header: list[str]) -> float:
    """Seconds in a unit of the times."""
    named = _TIME.fullmatch(header[0]) if header else None
    return _UNITS.get((named.group(3) or '').lower(), 1.0) if named else 1.0


class TaxelSimulatedSource(SceneSource):
    """A scene of the simulated array; a step is a frame. Parameters as in SceneSource."""

    usual_rate = 100.0
    longest_leap = 5

    def _open_scene(self):
        return open_taxel_scene(self._name, self.rate, self._seed)

    def _make(self, number: int):
        return self._scene.render(number / self.rate)

    def _handed_over(self, made, due_ns: int) -> Frame:
        values, truth = made
        return matrix_frame(values, (0, 0), self._stamp(due_ns), 'the simulated frame', truth)

    def describe(self) -> dict:
        """The scene, its seed and rate."""
        return super().describe() | {'device': 'simulated taxel_array'}
