# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A taxel array: on a serial port, in a recording without ROS, and simulated."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..frame import Frame, matrix_frame, sent_shape
from ..simulation.taxel.scene import open_taxel_scene
from ..sources.array_file import read_array_file
from ..sources.source import Clock, SceneSource
from .constants import SERIAL
from .frame_sources import FrameFileSource, FrameSerialSource
from .frames import MATRIX, BinaryReader


class TaxelSerialSource(FrameSerialSource):
    """A taxel array. values: as of SerialSource and sent_shape."""

    settings = 'baud, rows and columns'

    def _new_reader(self) -> BinaryReader:
        return BinaryReader(MATRIX, *sent_shape(self._values), self._counts)

    def _made(self, values: np.ndarray, stamp_ns: int, label: str) -> Frame:
        return matrix_frame(values, (0, 0), stamp_ns, label)


class TaxelFileSource(FrameFileSource):
    """A recording as of read_array_file. values: its, and those of PlayedSource (without times, a rate of -1 is 100 Hz, of a
    folder 10 Hz)."""

    def __init__(self, values: Mapping, clock: Clock):
        super().__init__(values, clock)
        self._values, self._about = values, ''

    def _load(self) -> tuple[np.ndarray, np.ndarray | None, float]:
        recording = read_array_file(self._path, self._values)
        self.warning, self._about = recording.warning, recording.about
        return recording.frames, recording.times, SERIAL.folder_rate if self._path.is_dir() else SERIAL.file_rate

    def _made(self, values: np.ndarray, stamp_ns: int, label: str) -> Frame:
        return matrix_frame(values, sent_shape(self._values), stamp_ns, label)

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
