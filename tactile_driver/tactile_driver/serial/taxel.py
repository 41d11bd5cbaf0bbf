# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A taxel array: on a serial port, in a recording without ROS, and simulated."""
from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ..frame import Frame, matrix_frame, sent_shape
from ..simulation.taxel.scene import open_taxel_scene
from ..sources.array_file import read_array_file
from ..sources.source import NS, Clock, PlayedSource, SceneSource, stamp_of
from .clock import DeviceClock
from .frames import MATRIX, BinaryReader
from .port import SerialSource


class TaxelSerialSource(SerialSource):
    """A taxel array. values: as of SerialSource and sent_shape."""

    deaf_bytes = 65536  # some frames of the largest arrays
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


_RATE, _FOLDER_RATE = 100.0, 10.0  # Hz of a file without times, as the simulated array, and of a folder, as slow mats


class TaxelFileSource(PlayedSource):
    """A recording as of read_array_file. values: its, and those of PlayedSource (without times, a rate of -1 is 100 Hz, of a
    folder 10 Hz)."""

    def __init__(self, values: Mapping, clock: Clock):
        super().__init__(values, clock)
        self._values, self._about = values, ''

    def _items(self) -> Iterator[tuple]:
        """(number, time in s, values) of each frame."""
        recording = read_array_file(self._path, self._values)
        self.warning, self._about = recording.warning, recording.about
        rate = _FOLDER_RATE if self._path.is_dir() else _RATE
        times = np.arange(len(recording.frames)) / rate if recording.times is None else recording.times
        return zip(range(len(times)), times, recording.frames)

    def _recorded(self, item: tuple) -> tuple[int, tuple]:
        return round(float(item[1]) * NS), item

    def _frame(self, content: tuple, due_ns: int) -> Frame:
        stamp = stamp_of(due_ns, self._clock) if due_ns else self._clock()
        return matrix_frame(content[2], sent_shape(self._values), stamp, f'frame {content[0]} of {self._path}')

    def describe(self) -> dict:
        """The path, the array, the rate (-1: as recorded) and what the values are."""
        return super().describe() | {'topic': self._values['topic'], 'values': self._about}


class TaxelSimulatedSource(SceneSource):
    """A scene of the simulated array; a step is a frame."""

    usual_rate = 100.0
    max_catch_up = 5
    sensor = 'taxel_array'
    _open_scene = staticmethod(open_taxel_scene)

    def _make(self, number: int):
        return self._scene.render(number / self.rate)

    def _handed_over(self, made, due_ns: int) -> Frame:
        values, truth = made
        return matrix_frame(values, (0, 0), self.stamp(due_ns), 'the simulated frame', truth)
