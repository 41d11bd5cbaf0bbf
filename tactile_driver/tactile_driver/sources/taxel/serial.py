# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The matrices of a taxel array on a serial port."""
from __future__ import annotations

from ..base.pacing import stamp_of
from ..base.protocol import Clock
from ..base.serial_source import FrameReader, SerialSource
from ...frame import Frame
from ...matrix import matrix_frame
from ...serial_frames.binary import MATRIX, BinaryReader, Expected
from ...serial_frames.counts import CountFrame
from ...serial_frames.device_clock import DeviceClock

_DEAF_BYTES = 65536  # so many bytes without a frame mean a wrong size or baud rate; chosen


class TaxelSerialSource(SerialSource):
    """A taxel array. device: see serial_port.find_port; shape: (rows, columns); clock: ns for the stamps."""

    def __init__(self, device: str, baud: int, shape: tuple[int, int], clock: Clock):
        self._shape = shape
        super().__init__(device, baud, clock, _DEAF_BYTES)

    def _new_reader(self) -> FrameReader:
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
