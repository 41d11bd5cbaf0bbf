# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A taxel array: on a serial port, in a file without ROS (.npz, .npy, .csv), and simulated."""
from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from ..errors import BadRecording
from ..frame import Frame, matrix_frame, sent_shape
from ..simulation.taxel.scene import open_taxel_scene
from ..sources.source import NS, Clock, PlayedSource, SceneSource, stamp_of
from .clock import DeviceClock
from .frames import MATRIX, BinaryReader
from .port import SerialSource


class TaxelSerialSource(SerialSource):
    """A taxel array. values: as of SerialSource and sent_shape."""

    deaf_bytes = 65536  # chosen: some frames of the largest arrays
    settings = 'baud, rows and columns'

    def _new_reader(self) -> BinaryReader:
        return BinaryReader(MATRIX, *sent_shape(self._values), self._counts)

    def _begin(self) -> None:
        super()._begin()
        self._device_clock = DeviceClock()

    @property
    def skipped(self) -> int:
        """Number of frames lost in transmission."""
        return self._counts.missing

    def _poll(self) -> list[Frame]:
        frames, arrived_ns = self._received()
        stamps = self._device_clock.to_host([frame.time_us for frame in frames], arrived_ns) if frames else []
        return [matrix_frame(frame.values, (0, 0), stamp_of(stamp, self._clock), f'frame {frame.sequence}')
                for frame, stamp in zip(frames, stamps)]

    def describe(self) -> dict:
        """The port and its error counts."""
        about = super().describe()
        return about | {'resets': about['resets'] + self._device_clock.resets}


_RATE = 100.0  # Hz of a recording without times; that of the simulated array
_TIMES = {'t': 1.0, 'stamps': 1.0, 't_ms': 1e-3}  # name of the times in an .npz: their unit, s
_TABLES = ('.csv', '.tsv', '.txt')


class TaxelFileSource(PlayedSource):
    """path: .npz with an array (frames, rows, columns) and maybe times t, stamps (s) or t_ms; .npy with such an array; .csv, .tsv and
    .txt as of read_table.

    values: as of PlayedSource (a rate of -1 is 100 Hz without times) and sent_shape; topic: the array's name in an .npz with several.
    """

    def __init__(self, values: Mapping, clock: Clock):
        super().__init__(values, clock)
        self._array, self._shape = values['topic'], sent_shape(values)

    def _items(self) -> Iterator[tuple]:
        """(number, time in s, values) of each frame."""
        try:
            frames, times = self._read()
        except (OSError, ValueError, BadZipFile) as error:  # a BadRecording is a ValueError, too
            raise BadRecording(f'path: {self._path} cannot be read: {error}') from error
        if frames.ndim != 3 or not len(frames) or frames.dtype.kind not in 'uifb':
            raise BadRecording(f'path: {self._path} holds an array of shape {frames.shape}; frames, rows, columns are needed')
        times = np.arange(len(frames)) / _RATE if times is None else times
        if len(times) != len(frames):
            raise BadRecording(f'path: {self._path} holds {len(frames)} frames but {len(times)} times')
        return zip(range(len(frames)), times, frames)

    def _read(self) -> tuple[np.ndarray, np.ndarray | None]:
        if self._path.suffix in _TABLES:
            return read_table(self._path, self._shape)
        if self._path.suffix == '.npy':
            return np.load(self._path), None
        if self._path.suffix != '.npz':
            raise BadRecording(f'it is none of .npz, .npy, {", ".join(_TABLES)}')
        with np.load(self._path) as stored:
            found = [name for name in stored.files if stored[name].ndim == 3]
            wanted = [name for name in found if self._array in ('', name)]
            if len(wanted) != 1:
                raise BadRecording(f'it holds the arrays {", ".join(found) or "none of frames"}; name one as topic')
            times = next((stored[name] * unit for name, unit in _TIMES.items() if name in stored.files), None)
            return stored[wanted[0]], times

    def _recorded(self, item: tuple) -> tuple[int, tuple]:
        return round(float(item[1]) * NS), item

    def _frame(self, content: tuple, due_ns: int) -> Frame:
        stamp = stamp_of(due_ns, self._clock) if due_ns else self._clock()
        return matrix_frame(content[2], self._shape, stamp, f'frame {content[0]} of {self._path}')

    def describe(self) -> dict:
        """The path, the array and the rate (-1: as recorded)."""
        return super().describe() | {'topic': self._array}


# A recording as text: a frame a line or a row of taxels a line, with or without header and times.
_SEPARATORS = ';', '\t', ','  # in this order: a line with semicolons may have commas in its numbers
_UNIT = re.compile('(?<![a-z])(ms|us)(?![a-z])', re.IGNORECASE)
_UNITS = {'ms': 1e-3, 'us': 1e-6}  # s


def read_table(path: Path, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray | None]:
    """Frames (N, rows, columns) of a text file in UTF-8, and their times (N,), s, or None; shape: (rows, columns).

    A line is a frame, row by row, or one row of taxels; a time may precede it, in s, or in ms or us if the header says so. Numbers are
    separated by commas, semicolons or tabs. Raises BadRecording with what was seen and what is expected.
    """
    header, table = _numbers(path)
    unit = _UNIT.search(header[0]) if header else None
    (rows, columns), wide = shape, table.shape[1]
    for lines, across in ((1, rows * columns), (rows, columns)):
        if wide in (across, across + 1) and len(table) % lines == 0:
            times = table[::lines, 0] * (_UNITS[unit[1].lower()] if unit else 1.0) if wide > across else None
            if times is not None and not (np.diff(times) > 0).all():
                number = int(np.argmin(np.diff(times) > 0)) + 1
                raise BadRecording(f'the times in the first column do not increase at frame {number}')
            return table[:, wide - across:].reshape(-1, *shape), times
    raise BadRecording(f'it has {len(table)} lines of {wide} numbers{" after a header" if header else ""}; expected for {rows} x '
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
                raise BadRecording(f'line {number} is not of numbers ({error}); after one line of names, numbers are '
                                   'expected, separated by commas, semicolons or tabs') from error
            header = fields
            continue
        if len(table[-1]) != len(table[0]):
            raise BadRecording(f'line {number} has {len(table[-1])} numbers, those before it {len(table[0])}')
    if not table:
        raise BadRecording('it has no line of numbers')
    return header, np.array(table)


class TaxelSimulatedSource(SceneSource):
    """A scene of the simulated array; a step is a frame."""

    usual_rate = 100.0
    longest_leap = 5
    sensor = 'taxel_array'
    _open_scene = staticmethod(open_taxel_scene)

    def _make(self, number: int):
        return self._scene.render(number / self.rate)

    def _handed_over(self, made, due_ns: int) -> Frame:
        values, truth = made
        return matrix_frame(values, (0, 0), self.stamp(due_ns), 'the simulated frame', truth)
