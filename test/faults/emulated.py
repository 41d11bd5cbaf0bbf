# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Emulated sensors on pseudo-terminals with numbered samples, so that every lost sample is detected; and the bus they are plugged into."""
from __future__ import annotations

import os
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from tactile_driver.emulators import PortEmulator, PsdEmulator

FULL_SCALE, BITS = 5.0, 12
_LOW = 1 << BITS


class _Running:
    """Sends from a thread of its own. spoil: what is done to the bytes of each frame; patient: it waits until all that it sends has room in
    Linux' buffer of 4 KB, where a real device would send on: what is missing after that, nobody else has lost."""

    def __init__(self, *args, patient: bool = False, **kwargs):
        self.spoil, self._patient = None, patient
        super().__init__(*args, **kwargs)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self.run, args=(self._stopped.is_set,), daemon=True)
        self._thread.start()

    def _frame(self) -> bytes:
        data = super()._frame()
        return self.spoil(data) if self.spoil else data

    def _write(self, data: bytes) -> None:
        if not self._patient:
            return super()._write(data)
        while data and not self._stopped.is_set():
            try:
                data = data[os.write(self._master, data):]
            except BlockingIOError:
                time.sleep(0.01)

    @property
    def number(self) -> int:
        """Of the sample that comes next."""
        return self._number

    def pull(self) -> None:
        """Pull the cable: the port is gone."""
        self._stopped.set()
        self._thread.join(timeout=5.0)


class CountingFinger(_Running, PsdEmulator):
    """A PSD finger whose first two outputs are the sample's number, and the others its mark."""

    def __init__(self, link: str | Path, mark: int = 0, rate: float = 200.0, **how):
        self._mark = mark
        super().__init__(link, 'taps', rate, 5, **how)

    def _counts(self) -> np.ndarray:
        number = np.arange(self._number, self._number + self._batch)
        mark = np.full(self._batch, self._mark)
        return np.stack([number % _LOW, number // _LOW, mark, mark], axis=1).astype(np.uint16)


class CountingArray(_Running, PortEmulator):
    """A taxel array of 4 x 4 whose first two values are the frame's number, and the others its mark."""

    def __init__(self, link: str | Path, mark: int = 0, rate: float = 40.0):
        self._mark = mark
        super().__init__(link, rate)

    def _counts(self) -> np.ndarray:
        values = np.full((4, 4), self._mark, np.uint16)
        values[0] = self._number % 256, self._number // 256, self._mark, self._mark
        return values


def samples(messages) -> np.ndarray:
    """(N, 2): number and mark of the samples in PsdVoltages."""
    volts = [np.reshape(message.voltages, (-1, 4)) for message in messages]
    counts = np.rint(np.concatenate([*volts, np.zeros((0, 4))]) * (_LOW / FULL_SCALE)).astype(int)
    return np.stack([counts[:, 0] + _LOW * counts[:, 1], counts[:, 2]], axis=1)


def frames(messages) -> np.ndarray:
    """(N, 2): number and mark of the frames in Images."""
    values = np.array([list(message.data[:4]) for message in messages], int).reshape(-1, 4)
    return np.stack([values[:, 0] + 256 * values[:, 1], values[:, 2]], axis=1)


class Bus:
    """Ports that serial sensors are plugged into; folder: where they stand in place of /dev."""

    def __init__(self, folder: Path):
        self.folder, self.by_id = folder, folder / 'by-id'
        self.by_id.mkdir()
        self._plugged: dict[str, tuple[object, Path]] = {}

    def comports(self) -> list:
        """As serial.tools.list_ports."""
        return [SimpleNamespace(device=str(port), serial_number=serial, description='emulated')
                for serial, (_, port) in self._plugged.items()]

    def plug(self, serial: str, kind: type, port: str, **how):
        """Plug a sensor of a serial number into a port; the emulator."""
        path = self.folder / port
        emulator = kind(path, **how)
        self._plugged[serial] = emulator, path
        (self.by_id / f'usb-Tactile_{serial}-if00').symlink_to(path)
        return emulator

    def pull(self, serial: str) -> None:
        """Pull the sensor's cable."""
        emulator, _ = self._plugged.pop(serial)
        (self.by_id / f'usb-Tactile_{serial}-if00').unlink()
        emulator.pull()

    def close(self) -> None:
        """Pull all cables."""
        for serial in list(self._plugged):
            self.pull(serial)
