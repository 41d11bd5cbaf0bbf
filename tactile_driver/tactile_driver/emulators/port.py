# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A sensor's firmware on a pseudo-terminal, with the faults that real ones have; what is sent, subclasses say."""
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
from ..sources.base.pacing import NS, wait_until

_GARBAGE, _DROPPED = 300, 40  # bytes
_PAUSE_S = 1.0
_LARGEST_BACKLOG_NS = 5 * 10**8  # what a busy machine may be late by without a gap in what the device sends


def _drop(data: bytes, rng: np.random.Generator) -> bytes:
    place = int(rng.integers(0, max(len(data) - 1, 1)))
    return data[:place] + data[place + int(rng.integers(1, _DROPPED)):]


def _swap(data: bytes, rng: np.random.Generator) -> bytes:
    place = int(rng.integers(0, max(len(data) - 1, 1)))
    return data[:place] + data[place:place + 2][::-1] + data[place + 2:]


def _garbage(data: bytes, rng: np.random.Generator) -> bytes:
    return rng.bytes(_GARBAGE) + data


def _wrong_baud(data: bytes, rng: np.random.Generator) -> bytes:
    """What a receiver at another rate makes of it: fewer bytes, none of them right."""
    return bytes(b ^ 0xA5 | 0x80 for b in data[::2])


#: What happens to the bytes of one frame.
CORRUPTIONS: dict[str, Callable[[bytes, np.random.Generator], bytes]] = {
    'drop': _drop, 'swap': _swap, 'garbage': _garbage, 'wrong_baud': _wrong_baud}
#: pause: nothing is sent for a second; reset: sequence and clock begin anew; unplug: the port is gone for a second.
FAULTS = (*CORRUPTIONS, 'pause', 'reset', 'unplug')


class PortEmulator:
    """Sends batches of samples, rate a second, on a pseudo-terminal.

    link: path of a symbolic link to the port, which stays the same when it is unplugged; seed: of the faults. Subclasses make the bytes of
    the next batch in _frame, and count on _number (samples) and _sequence (batches); _zero is the sample at which the device began.
    """

    def __init__(self, link: str | Path, rate: float, batch: int, seed: int):
        self.link, self._rate, self._batch = Path(link), rate, batch
        self._rng, self._lock = np.random.default_rng(seed), threading.Lock()
        self._wanted: list[str] = []
        self._number = self._sequence = self._zero = 0
        self._master = self._slave = None
        self._plug()

    def fault(self, name: str) -> None:
        """Make a fault of FAULTS happen to the next frame. Raises BadArgument, listing them."""
        if name not in FAULTS:
            raise BadArgument(f'fault {name!r} is unknown; choose one of {", ".join(FAULTS)}')
        with self._lock:
            self._wanted.append(name)

    def run(self, stopped: Callable[[], bool]) -> None:
        """Send in real time until stopped() says so."""
        begin, step = time.monotonic_ns(), NS * self._batch / self._rate
        count = 0
        while not stopped():
            late = int((time.monotonic_ns() - begin) / step) - count
            if late * step > _LARGEST_BACKLOG_NS:  # the device's clock goes on
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
        """The bytes of the next batch."""
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
            except BlockingIOError:  # nobody reads: a serial port would lose it too
                return


def emulator_parser(prog: str, description: str, link: str, rate: float) -> argparse.ArgumentParser:
    """Of the arguments that all emulators take; link: name of the symbolic link; rate: of what a device sends, Hz."""
    parser = argparse.ArgumentParser(prog=prog, description=description)
    parser.add_argument('--link', default=link, help='symbolic link to the pseudo-terminal: what the driver opens as device')
    parser.add_argument('--scene', default='demo')
    parser.add_argument('--rate', type=float, default=rate, help='samples or frames a second')
    parser.add_argument('--seed', type=int, default=0)
    return parser


def serve(emulator: PortEmulator) -> int:
    """Send until interrupted, with faults from the standard input, one a line; the exit code."""
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
    """Faults from the standard input, one a line."""
    for line in sys.stdin:
        try:
            if line.strip():
                emulator.fault(line.strip())
        except BadArgument as error:
            print(error, flush=True)
