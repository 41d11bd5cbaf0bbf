# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Taxels that measure force vectors: on a serial port, in a recording without ROS, and simulated."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..serial.frame_sources import FrameFileSource, FrameSerialSource
from ..serial.frames import VECTORS, BinaryReader
from ..simulation.force_taxels.scene import open_vector_scene
from ..sources.array_file import read_vector_file
from ..sources.source import Clock, SceneSource
from .constants import FORCE_TAXEL_DRIVER
from .layout import TaxelFrame, TaxelLayout, read_layout, taxel_frame


class VectorSerialSource(FrameSerialSource):
    """A device that sends kind 3 of doc/serial_protocol.md. values: as of SerialSource, and layout. Raises BadArgument."""

    settings = 'baud and layout'

    def __init__(self, values: Mapping, clock: Clock):
        self._layout = read_layout(values['layout'])
        super().__init__(values, clock)

    def _new_reader(self) -> BinaryReader:
        return BinaryReader(VECTORS, len(self._layout.positions), 3, self._counts)

    def _made(self, values: np.ndarray, stamp_ns: int, label: str) -> TaxelFrame:
        return taxel_frame(self._layout, values, stamp_ns, label)

    def describe(self) -> dict:
        """The port, its error counts and the number of taxels."""
        return super().describe() | {'taxels': len(self._layout.positions)}


class VectorFileSource(FrameFileSource):
    """A recording as of read_vector_file. values: layout, columns, topic, and those of PlayedSource. Raises BadArgument."""

    def __init__(self, values: Mapping, clock: Clock):
        super().__init__(values, clock)
        self._layout, self._columns, self._topic = read_layout(values['layout']), values['columns'], values['topic']

    def _load(self) -> tuple[np.ndarray, np.ndarray | None, float]:
        return *read_vector_file(self._path, len(self._layout.positions), self._columns, self._topic), FORCE_TAXEL_DRIVER.file_rate

    def _made(self, values: np.ndarray, stamp_ns: int, label: str) -> TaxelFrame:
        return taxel_frame(self._layout, values, stamp_ns, label)


class VectorSimulatedSource(SceneSource):
    """A scene of a simulated device; a step is a frame."""

    usual_rate = 100.0
    max_catch_up = 5
    sensor = 'force_taxels'
    _open_scene = staticmethod(open_vector_scene)

    def _make(self, number: int):
        return self._scene.render(number / self.rate)

    def _handed_over(self, made, due_ns: int) -> TaxelFrame:
        numbers, truth = made
        return replace(simulated_frame(self._scene.shape, numbers, self.stamp(due_ns)), truth=truth)


def simulated_frame(shape, numbers: np.ndarray, stamp_ns: int) -> TaxelFrame:
    """The frame of the numbers (N, 3) of a simulated device, of which a press is positive."""
    return taxel_frame(TaxelLayout(shape.positions, shape.normals, shape.axes), numbers, stamp_ns, 'the simulated frame')
