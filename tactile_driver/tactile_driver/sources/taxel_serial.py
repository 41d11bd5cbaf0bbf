# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The matrices of a taxel array on a serial port."""
from __future__ import annotations

import time

from ..frame import Frame
from ..matrix import matrix_frame
from ..serial_frames.binary import MATRIX, BinaryReader, Expected
from ..serial_frames.counts import CountFrame, FrameCounts
from ..serial_frames.device_clock import DeviceClock
from .pacing import stamp_of
from .protocol import Clock, NothingYet
from .serial_port import SerialPort

_DEAF_BYTES = 65536  # without a frame among so many, size or baud rate are wrong


class TaxelSerialSource:
    """device: see serial_port.find_port; shape: (rows, columns); clock: ns for the stamps."""

    live, on_demand = True, False

    def __init__(self, device: str, baud: int, shape: tuple[int, int], clock: Clock):
        self._port, self._baud, self._shape, self._clock = SerialPort(device, baud), baud, shape, clock
        self._counts, self._resets = FrameCounts(), 0
        self._begin()

    def _begin(self) -> None:
        self._reader = BinaryReader(Expected(MATRIX, *self._shape), self._counts)
        self._device_clock = DeviceClock()
        self._frames: list[tuple[CountFrame, int]] = []
        self._deaf = 0

    @property
    def skipped(self) -> int:
        """Frames that the device has sent and that did not come, or not whole."""
        return self._counts.missing

    @property
    def corrupt(self) -> int:
        """Frames with a wrong check sum or impossible content."""
        return self._counts.bad_crc + self._counts.refused

    def open(self) -> None:
        """Open the port. Raises DeviceLost."""
        self._port.open()
        self._begin()

    def read(self, wanted: bool = True) -> Frame | None:
        """The next frame. Raises NothingYet or DeviceLost."""
        if not self._frames:
            self._poll()
        if not self._frames:
            raise NothingYet
        found, stamp_ns = self._frames.pop(0)
        if not wanted:
            return None
        return matrix_frame(found.values, self._shape, stamp_of(stamp_ns, self._clock), f'frame {found.sequence}')

    def _poll(self) -> None:
        data = self._port.read()
        arrived_ns = time.monotonic_ns()
        frames = self._reader.feed(data)
        self._deaf = 0 if frames else self._deaf + len(data)
        if frames:
            stamps = self._device_clock.to_host([frame.time_us for frame in frames], arrived_ns)
            self._frames = list(zip(frames, stamps))

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def describe(self) -> dict:
        """The port and what it has met."""
        counts = self._counts
        return {'source': 'device', 'path': self._port.path, 'device': self._port.path, 'baud': self._baud, 'rate': 0.0,
                'crc errors': counts.bad_crc, 'refused frames': counts.refused, 'garbage bytes': counts.garbage,
                'missing frames': counts.missing, 'resets': counts.resets + self._device_clock.resets}

    @property
    def remark(self) -> str:
        """What is wrong though bytes come, ''."""
        if self._deaf < _DEAF_BYTES:
            return ''
        return f'bytes come from {self._port.path}, but no frames of {self._shape[0]} x {self._shape[1]}: check rows, columns and baud'

    def calibration(self) -> None:
        """None: there is no camera."""
