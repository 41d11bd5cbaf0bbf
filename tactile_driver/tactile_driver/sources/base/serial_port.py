# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Serial ports: find the one that the user names, and read from it."""
from __future__ import annotations

from pathlib import Path

import serial
from serial.tools import list_ports

from ...errors import BadArgument, DeviceLost

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
