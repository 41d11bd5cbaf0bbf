# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The base of sources on a serial port: the port, its frame reader and error counts."""
from __future__ import annotations

import time
from typing import Protocol

from .protocol import Clock, NothingYet, Source
from ...serial_frames.counts import CountFrame, FrameCounts
from .serial_port import SerialPort


class FrameReader(Protocol):
    """Parses bytes into frames."""

    def feed(self, data: bytes) -> list[CountFrame]:
        """The frames that are complete with data."""


class SerialSource(Source):
    """device: see serial_port.find_port; baud: bit/s; clock: ns for the stamps; deaf_bytes: so many bytes without a frame mean wrong
    settings. Subclasses return a new reader from _new_reader and fill _ready in _poll.
    """

    live = True

    def __init__(self, device: str, baud: int, clock: Clock, deaf_bytes: int):
        self._port, self._baud, self._clock, self._deaf_bytes = SerialPort(device, baud), baud, clock, deaf_bytes
        self._counts = FrameCounts()
        self._begin()

    def _new_reader(self) -> FrameReader:
        raise NotImplementedError

    def _begin(self) -> None:
        """Start with a new reader; the counts continue."""
        self._counts.stranger = ''
        self._reader, self._ready, self._deaf = self._new_reader(), [], 0

    @property
    def corrupt(self) -> int:
        """Number of frames or lines with a wrong checksum or impossible content."""
        return self._counts.bad_crc + self._counts.refused

    def open(self) -> None:
        """Open the port. Raises DeviceLost."""
        self._port.open()
        self._begin()

    def read(self, wanted: bool = True):
        """The next frame or block. Raises NothingYet or DeviceLost."""
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
        """The complete frames, and the time at which they were read, ns of the monotonic clock."""
        data = self._port.read()
        arrived_ns = time.monotonic_ns()
        frames = self._reader.feed(data)
        self._deaf = 0 if frames else self._deaf + len(data)
        return frames, arrived_ns

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def describe(self) -> dict:
        """The port and its error counts."""
        counts = self._counts
        return {'source': 'device', 'path': self._port.path, 'device': self._port.path, 'baud': self._baud, 'rate': 0.0,
                'crc errors': counts.bad_crc, 'refused frames': counts.refused, 'garbage bytes': counts.garbage,
                'missing frames': counts.missing, 'resets': counts.resets}

    @property
    def remark(self) -> str:
        """The warning if bytes arrive but no valid frames, ''."""
        if self._counts.stranger:
            return (f'another sensor sends on {self._port.path}: {self._counts.stranger}; if cables were swapped, name the device by '
                    'its serial number, else set the parameters to match')
        return self._deafness() if self._deaf >= self._deaf_bytes else ''

    def _deafness(self) -> str:
        raise NotImplementedError
