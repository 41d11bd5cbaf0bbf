# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Base of the firmware emulators: sends frames on a pseudo-terminal and injects the faults of real serial links."""
from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
import time
import tty
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..errors import BadArgument
from ..sources.source import NS, wait_until

_GARBAGE, _DROPPED = 300, 40  # bytes inserted before a frame; limit of the bytes dropped from one; chosen
_PAUSE_S = 1.0  # duration of the faults pause and unplug; chosen
_LARGEST_BACKLOG_NS = 5 * 10**8  # a delay of the machine up to this is caught up; a longer one leaves a gap in the data; chosen


def _drop(data: bytes, rng: np.random.Generator) -> bytes:
    place = int(rng.integers(0, max(len(data) - 1, 1)))
    return data[:place] + data[place + int(rng.integers(1, _DROPPED)):]


def _swap(data: bytes, rng: np.random.Generator) -> bytes:
    place = int(rng.integers(0, max(len(data) - 1, 1)))
    return data[:place] + data[place:place + 2][::-1] + data[place + 2:]


def _garbage(data: bytes, rng: np.random.Generator) -> bytes:
    return rng.bytes(_GARBAGE) + data


def _wrong_baud(data: bytes, rng: np.random.Generator) -> bytes:
    """The frame as received at a wrong baud rate: fewer bytes, all of them wrong."""
    return bytes(b ^ 0xA5 | 0x80 for b in data[::2])


#: Faults that corrupt the bytes of one frame.
CORRUPTIONS: dict[str, Callable[[bytes, np.random.Generator], bytes]] = {
    'drop': _drop, 'swap': _swap, 'garbage': _garbage, 'wrong_baud': _wrong_baud}
#: All faults. pause: nothing is sent for 1 s; reset: sequence number and clock restart at 0; unplug: the port disappears for 1 s.
FAULTS = (*CORRUPTIONS, 'pause', 'reset', 'unplug')


class PortEmulator:
    """Sends rate samples/s on a pseudo-terminal, batch samples in a frame.

    link: path of a symbolic link to the port, which survives unplugging; seed: of the faults. A subclass returns the bytes of the next
    frame from _frame and advances _number (samples) and _sequence (frames); _zero is the number of the sample at the last reset.
    """

    def __init__(self, link: str | Path, rate: float, batch: int, seed: int):
        self.link, self._rate, self._batch = Path(link), rate, batch
        self._rng, self._lock = np.random.default_rng(seed), threading.Lock()
        self._wanted: list[str] = []
        self._number = self._sequence = self._zero = 0
        self._master = self._slave = None
        self._plug()

    def fault(self, name: str) -> None:
        """Apply a fault of FAULTS to the next frame. Raises BadArgument, listing FAULTS, for another name."""
        if name not in FAULTS:
            raise BadArgument(f'fault {name!r} is unknown; choose one of {", ".join(FAULTS)}')
        with self._lock:
            self._wanted.append(name)

    def run(self, stopped: Callable[[], bool]) -> None:
        """Send in real time until stopped() returns True."""
        begin, step = time.monotonic_ns(), NS * self._batch / self._rate
        count = 0
        while not stopped():
            late = int((time.monotonic_ns() - begin) / step) - count
            if late * step > _LARGEST_BACKLOG_NS:  # the device's clock runs on
                self._number, count = self._number + late * self._batch, count + late
            wait_until(begin + int((count + 1) * step))
            count += 1
            data = self._frame()
            with self._lock:
                faults, self._wanted = self._wanted, []
            for name in faults:
                data = CORRUPTIONS[name](data, self._rng) if name in CORRUPTIONS else self._happen(name, data)
            self._write(data)
        self._unplug()

    def _frame(self) -> bytes:
        """The bytes of the next frame."""
        raise NotImplementedError

    def _happen(self, name: str, data: bytes) -> bytes:
        if name == 'reset':
            self._zero, self._sequence = self._number, 0
        if name == 'unplug':
            self._unplug()
        if name in ('pause', 'unplug'):
            time.sleep(_PAUSE_S)
        if name == 'unplug':
            self._plug()
        return data

    def _plug(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        fresh = self.link.with_name(self.link.name + '.new')
        fresh.unlink(missing_ok=True)
        fresh.symlink_to(os.ttyname(self._slave))
        fresh.replace(self.link)

    def _unplug(self) -> None:
        self.link.unlink(missing_ok=True)
        for handle in (self._slave, self._master):
            if handle is not None:
                os.close(handle)
        self._master = self._slave = None

    def _write(self, data: bytes) -> None:
        while data and self._master is not None:
            try:
                data = data[os.write(self._master, data):]
            except BlockingIOError:  # nobody reads; a serial port would lose the bytes too
                return


def emulator_parser(prog: str, description: str, link: str, rate: float) -> argparse.ArgumentParser:
    """Parser of the arguments common to all emulators; link: default symbolic link; rate: default rate, Hz."""
    parser = argparse.ArgumentParser(prog=prog, description=description)
    parser.add_argument('--link', default=link, help='symbolic link to the pseudo-terminal: what the driver opens as device')
    parser.add_argument('--scene', default='demo')
    parser.add_argument('--rate', type=float, default=rate, help='samples or frames a second')
    parser.add_argument('--seed', type=int, default=0)
    return parser


def serve(emulator: PortEmulator) -> int:
    """Send until interrupted, with faults read from standard input, one per line. Returns the exit code."""
    print(f'sending to {emulator.link.absolute()}; type a fault and Enter: {", ".join(FAULTS)}', flush=True)
    threading.Thread(target=_listen, args=(emulator,), daemon=True).start()
    for number in (signal.SIGINT, signal.SIGTERM):  # a script's background process starts with SIGINT ignored
        signal.signal(number, signal.default_int_handler)
    try:
        emulator.run(lambda: False)
    except KeyboardInterrupt:
        emulator.link.unlink(missing_ok=True)
    return 0


def _listen(emulator: PortEmulator) -> None:
    """Pass the faults typed on standard input, one per line, to the emulator."""
    for line in sys.stdin:
        try:
            if line.strip():
                emulator.fault(line.strip())
        except BadArgument as error:
            print(error, flush=True)
