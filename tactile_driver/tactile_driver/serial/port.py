# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Serial ports: found by name, read, and the base of the sources on them."""
from __future__ import annotations

import time
from pathlib import Path

import serial
from serial.tools import list_ports

from ..errors import BadArgument, DeviceLost
from ..sources.source import Clock, NothingYet, Source
from .frames import BinaryReader, CountFrame, FrameCounts, LineReader

_WAIT_S = 0.1
_BY_ID = Path('/dev', 'serial', 'by-id')


def find_port(wanted: str) -> str:
    """The path of the port named by wanted: a path, a name under /dev/serial/by-id, or (part of) a USB serial number.

    Raises DeviceLost, listing the ports, if none or several match.
    """
    if wanted.startswith('/'):
        if Path(wanted).exists():
            return wanted
        raise DeviceLost(f'device: {wanted} does not exist; {_known()}')
    if wanted and (_BY_ID / wanted).exists():
        return str(_BY_ID / wanted)
    found = [port.device for port in list_ports.comports() if wanted and wanted in (port.serial_number or '')]
    if len(found) == 1:
        return found[0]
    raise DeviceLost(f'device: {wanted!r} {"fits several serial ports" if found else "is no serial port"}; {_known()}')


def _known() -> str:
    ports = '; '.join(f'{p.device} ({p.description}' + (f', serial {p.serial_number})' if p.serial_number else ')')
                      for p in list_ports.comports())
    return f'there are: {ports or "none"}. Name one by path or serial number, and check the cable'


class SerialPort:
    """One port; device: see find_port; baud: bits a second."""

    def __init__(self, device: str, baud: int):
        if not device:
            raise BadArgument('device: source device needs a serial port: a path, a name under /dev/serial/by-id or a serial number')
        self._device, self._baud = device, baud
        self._port: serial.Serial | None = None
        self.path = ''

    def open(self) -> None:
        """Open or reopen the port. Raises DeviceLost if it does not exist or cannot be opened."""
        self.close()
        self.path = find_port(self._device)
        try:
            self._port = serial.Serial(self.path, self._baud, timeout=_WAIT_S, exclusive=True)
        except (OSError, ValueError) as error:  # SerialException is an OSError
            self._port = None
            raise DeviceLost(f'device: {self.path} cannot be opened at {self._baud} baud: {error}; is it in use, or access denied '
                             '(group dialout)?') from error

    def read(self) -> bytes:
        """The bytes received; b'' after a moment without any. Raises DeviceLost if the port is gone."""
        if self._port is None:
            raise DeviceLost(f'device: {self._device} is not open')
        try:
            waiting = self._port.in_waiting
            data = self._port.read(waiting or 1)
            return data if waiting or not data else data + self._port.read(self._port.in_waiting)
        except (OSError, TypeError) as error:  # pyserial raises TypeError if the port was closed meanwhile
            raise DeviceLost(f'device: {self.path} is gone ({error}); check the cable') from error

    def close(self) -> None:
        """Close the port; does nothing if it is not open."""
        port, self._port = self._port, None
        if port is not None:
            try:
                port.close()
            except OSError:  # unplugged
                pass


class SerialSource(Source):
    """device: see serial_port.find_port; baud: bit/s; clock: ns for the stamps; deaf_bytes: so many bytes without a frame mean wrong
    settings. Subclasses return a new reader from _new_reader and fill _ready in _poll.
    """

    live = True

    def __init__(self, device: str, baud: int, clock: Clock, deaf_bytes: int):
        self._port, self._baud, self._clock, self._deaf_bytes = SerialPort(device, baud), baud, clock, deaf_bytes
        self._counts = FrameCounts()
        self._begin()

    def _new_reader(self) -> BinaryReader | LineReader:
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
    def warning(self) -> str:
        """The warning if bytes arrive but no valid frames, ''."""
        if self._counts.stranger:
            return (f'another sensor sends on {self._port.path}: {self._counts.stranger}; if cables were swapped, name the device by '
                    'its serial number, else set the parameters to match')
        return self._deafness() if self._deaf >= self._deaf_bytes else ''

    def _deafness(self) -> str:
        raise NotImplementedError
