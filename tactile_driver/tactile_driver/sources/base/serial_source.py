# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What sensors on a serial port share: the port, the frames read from it, and what it has met."""
from __future__ import annotations

import time
from typing import Protocol

from .protocol import Clock, NothingYet
from ...serial_frames.counts import CountFrame, FrameCounts
from .serial_port import SerialPort


class FrameReader(Protocol):
    """Makes frames of bytes."""

    def feed(self, data: bytes) -> list[CountFrame]:
        """The frames that data ends."""


class SerialSource:
    """device: see serial_port.find_port; baud: bits a second; clock: ns for the stamps; deaf_bytes: without a frame among so many, what is
    expected of the device is wrong. Subclasses give a new reader in _new_reader and fill _ready with what comes next in _poll.
    """

    live, on_demand = True, False

    def __init__(self, device: str, baud: int, clock: Clock, deaf_bytes: int):
        self._port, self._baud, self._clock, self._deaf_bytes = SerialPort(device, baud), baud, clock, deaf_bytes
        self._counts = FrameCounts()
        self._begin()

    def _new_reader(self) -> FrameReader:
        raise NotImplementedError

    def _begin(self) -> None:
        """What was begun on a port that is gone is forgotten; what has been counted is not."""
        self._counts.stranger = ''
        self._reader, self._ready, self._deaf = self._new_reader(), [], 0

    @property
    def corrupt(self) -> int:
        """Frames or lines with a wrong check sum or impossible content."""
        return self._counts.bad_crc + self._counts.refused

    def open(self) -> None:
        """Open the port. Raises DeviceLost."""
        self._port.open()
        self._begin()

    def read(self, wanted: bool = True):
        """What comes next. Raises NothingYet or DeviceLost."""
        if not self._ready:
            self._poll()
        if not self._ready:
            raise NothingYet
        found = self._ready.pop(0)
        return self._delivered(found) if wanted else None

    def _poll(self) -> None:
        raise NotImplementedError

    def _delivered(self, found):
        return found

    def _received(self) -> tuple[list[CountFrame], int]:
        """The frames that have come whole, and when they were read, ns of the monotonic clock."""
        data = self._port.read()
        arrived_ns = time.monotonic_ns()
        frames = self._reader.feed(data)
        self._deaf = 0 if frames else self._deaf + len(data)
        return frames, arrived_ns

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def describe(self) -> dict:
        """The port and what it has met."""
        counts = self._counts
        return {'source': 'device', 'path': self._port.path, 'device': self._port.path, 'baud': self._baud, 'rate': 0.0,
                'crc errors': counts.bad_crc, 'refused frames': counts.refused, 'garbage bytes': counts.garbage,
                'missing frames': counts.missing, 'resets': counts.resets}

    @property
    def remark(self) -> str:
        """What is wrong though bytes come, ''."""
        if self._counts.stranger:
            return (f'another sensor sends on {self._port.path}: {self._counts.stranger}; where cables were swapped, name the device by '
                    'its serial number, else set the parameters that tell what it sends')
        return self._deafness() if self._deaf >= self._deaf_bytes else ''

    def _deafness(self) -> str:
        raise NotImplementedError

    def calibration(self) -> None:
        """None: there is no camera."""
