# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Serial ports: found by name, and the base of the sources on them."""
from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import serial
from serial.tools import list_ports

from ..errors import BadArgument, DeviceLost
from ..sources.source import Clock, NothingYet, Source
from .constants import SERIAL
from .frames import CountFrame, FrameCounts

_BY_ID = Path('/dev', 'serial', 'by-id')


def find_port(wanted: str) -> str:
    """Find a serial port.

    Parameters
    ----------
    wanted : str
        Path, name under ``/dev/serial/by-id``, or USB serial number or a part of it.

    Returns
    -------
    str
        Path of the port.

    Raises
    ------
    DeviceLost
        If no port or several ports match; the message lists the ports.
    """
    path = _BY_ID / wanted  # of an absolute name that name itself
    if wanted and path.exists():
        return str(path)
    ports = list_ports.comports()
    known = '; '.join(f'{p.device} ({p.description}' + (f', serial {p.serial_number})' if p.serial_number else ')') for p in ports)
    known = f'there are: {known or "none"}. Name one by path or serial number, and check the cable'
    if wanted.startswith('/'):
        raise DeviceLost(f'device: {wanted} does not exist; {known}')
    found = [port.device for port in ports if wanted and wanted in (port.serial_number or '')]
    if len(found) == 1:
        return found[0]
    raise DeviceLost(f'device: {wanted!r} {"fits several serial ports" if found else "is not a serial port"}; {known}')


class SerialSource(Source):
    """Base class of the sources on serial ports.

    A subclass returns a new `BinaryReader` or `LineReader` from ``_new_reader``, and the received frames or blocks from ``_poll``.

    Parameters
    ----------
    values : Mapping
        Parameters of the driver: ``device``, see `find_port`, and ``baud`` in bit/s.
    clock : callable
        Clock of the stamps, in ns.

    Attributes
    ----------
    deaf_bytes : int
        After this number of bytes without a frame, a warning says that the parameters in `settings` are wrong.
    settings : str
        Names of the parameters that determine the format.

    Raises
    ------
    BadArgument
        If ``device`` is empty.
    """

    live = True
    deaf_bytes = 4096
    settings = 'baud and format'

    def __init__(self, values: Mapping, clock: Clock):
        if not values['device']:
            raise BadArgument('device: source device needs a serial port: a path, a name under /dev/serial/by-id or a serial number')
        self._values, self._clock, self._path, self._port = values, clock, '', None
        self._counts = FrameCounts()
        self._begin()

    def _begin(self) -> None:
        """Start with a new reader; the counts continue."""
        self._counts.stranger = ''
        self._reader, self._ready, self._deaf = self._new_reader(), [], 0

    @property
    def corrupt(self) -> int:
        """Number of frames or lines with a wrong checksum or impossible content."""
        return self._counts.bad_crc + self._counts.refused

    def open(self) -> None:
        """Open or reopen the port. Raises DeviceLost if it does not exist or cannot be opened."""
        self.close()
        self._path, baud = find_port(self._values['device']), self._values['baud']
        try:
            self._port = serial.Serial(self._path, baud, timeout=SERIAL.max_read_s, exclusive=True)
        except (OSError, ValueError) as error:  # SerialException is an OSError
            raise DeviceLost(f'device: {self._path} cannot be opened at {baud} baud: {error}; is it in use, or access denied '
                             '(group dialout)?') from error
        self._begin()

    def read(self, wanted: bool = True):
        """Next frame or block; see `Source.read`."""
        self._ready = self._ready or self._poll()
        if not self._ready:
            raise NothingYet
        found = self._ready.pop(0)
        return found if wanted else None

    def _received(self) -> tuple[list[CountFrame], int]:
        """Complete frames, none after a moment without any, and when they were read, ns of the monotonic clock. Raises DeviceLost."""
        if self._port is None:
            raise DeviceLost(f'device: {self._values["device"]} is not open')
        try:
            data = self._port.read(self._port.in_waiting or 1)
            data += self._port.read(self._port.in_waiting)
        except (OSError, TypeError) as error:  # pyserial raises TypeError if the port was closed meanwhile
            raise DeviceLost(f'device: {self._path} is gone ({error}); check the cable') from error
        arrived_ns = time.monotonic_ns()
        frames = self._reader.feed(data)
        self._deaf = 0 if frames else self._deaf + len(data)
        return frames, arrived_ns

    def close(self) -> None:
        """Close the port; does nothing if it is not open."""
        port, self._port = self._port, None
        if port is not None:
            with suppress(OSError):  # unplugged
                port.close()

    def describe(self) -> dict:
        """Port and its error counts; see `Source.describe`."""
        counts = self._counts
        return {'path': self._path, 'device': self._path, 'baud': self._values['baud'], 'rate': 0.0,
                'crc errors': counts.bad_crc, 'refused frames': counts.refused, 'garbage bytes': counts.garbage,
                'missing frames': counts.missing, 'resets': counts.resets}

    @property
    def warning(self) -> str:
        """The warning if bytes arrive but no valid frames, ''."""
        if self._counts.stranger:
            return (f'another sensor sends on {self._path}: {self._counts.stranger}; if cables were swapped, name the device by '
                    'its serial number, else set the parameters to match')
        return f'bytes come from {self._path}, but no frames: check parameters {self.settings}' if self._deaf >= self.deaf_bytes else ''
