# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The commands psd_emulator and taxel_emulator: firmware of sensors on a pseudo-terminal, with real faults."""
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

from .constants import DRIVER
from .errors import BadArgument, reports_errors
from .frame import CHANNELS
from .serial.frames import LARGEST, MATRIX, SAMPLES, CountFrame, write_frame, write_line
from .simulation.psd_scene import open_psd_scene
from .simulation.taxel.scene import open_taxel_scene
from .sources.source import NS, wait_until


def _drop(data: bytes, rng: np.random.Generator) -> bytes:
    start = int(rng.integers(0, max(len(data) - 1, 1)))
    return data[:start] + data[start + int(rng.integers(1, DRIVER.max_dropped_bytes)):]


def _swap(data: bytes, rng: np.random.Generator) -> bytes:
    start = int(rng.integers(0, max(len(data) - 1, 1)))
    return data[:start] + data[start:start + 2][::-1] + data[start + 2:]


#: Faults that corrupt the bytes of one frame. wrong_baud: fewer bytes arrive, all of them wrong.
CORRUPTIONS: dict[str, Callable[[bytes, np.random.Generator], bytes]] = {
    'drop': _drop, 'swap': _swap, 'garbage': lambda data, rng: rng.bytes(DRIVER.garbage_bytes) + data,
    'wrong_baud': lambda data, _rng: bytes(b ^ 0xA5 | 0x80 for b in data[::2])}
#: All faults. pause: nothing is sent for 1 s; reset: sequence number and clock restart at 0; unplug: the port disappears for 1 s.
FAULTS = (*CORRUPTIONS, 'pause', 'reset', 'unplug')


class PortEmulator:
    """Sends rate samples or matrices/s on a pseudo-terminal, batch samples in a frame.

    link: path of a symbolic link to the port, which survives unplugging; seed: of the faults. A subclass has the kind of its frames and the
    bits of its counts, and returns the counts (rows, columns) of the next frame, whose first sample is _number, from _counts.
    """

    kind, bits = MATRIX, 8
    pace = 1.0  # s of the device in a s of real time
    sent: list[np.ndarray] | None = None  # a list to which the counts of every frame are appended; None keeps none
    runs_on = True  # whether the device's clock runs on while the machine is too slow; False: the device becomes slower

    def __init__(self, link: str | Path, rate: float, batch: int = 1, seed: int = 0):
        self.link, self._rate, self._batch = Path(link), rate, batch
        self._rng, self._lock = np.random.default_rng(seed), threading.Lock()
        self._wanted: list[str] = []
        self._number = self._sequence = self._zero = 0  # samples and frames sent; the sample of the last reset
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
        begin, step = time.monotonic_ns(), NS * self._batch / (self._rate * self.pace)
        count = 0
        while not stopped():
            late = int((time.monotonic_ns() - begin) / step) - count
            if late * step > DRIVER.max_backlog_ns:
                if self.runs_on:
                    self._number, count = self._number + late * self._batch, count + late
                else:
                    begin += int(late * step)
            wait_until(begin + int((count + 1) * step))
            count += 1
            data = self._frame()
            with self._lock:
                faults, self._wanted = self._wanted, []
            for name in faults:
                data = CORRUPTIONS[name](data, self._rng) if name in CORRUPTIONS else data
                self._happen(name)
            self._write(data)
        self._unplug()

    def _frame(self) -> bytes:
        """The bytes of the next frame."""
        counts, time_us = self._counts(), int((self._number - self._zero) * 1e6 / self._rate)
        if self.sent is not None:
            self.sent.append(counts)
        interval_ns = round(NS / self._rate) if self.kind == SAMPLES else 0
        data = self._encoded(CountFrame(counts, time_us, interval_ns, self._sequence, self.bits))
        self._number, self._sequence = self._number + self._batch, self._sequence + 1
        return data

    def _encoded(self, frame: CountFrame) -> bytes:
        return write_frame(frame, self.kind)

    def _happen(self, name: str) -> None:
        if name == 'reset':
            self._zero, self._sequence = self._number, 0
        if name == 'unplug':
            self._unplug()
        if name in ('pause', 'unplug'):
            time.sleep(DRIVER.fault_pause_s)
        if name == 'unplug':
            self._plug()

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


class PsdEmulator(PortEmulator):
    """Plays a scene of the simulated finger.

    format: binary or csv. Raises BadArgument for a batch outside 1 to 256 or another format.
    """

    kind = SAMPLES
    modulation = False  # True: the finger's light is on in every second sample only, and a fifth column indicates which

    def __init__(self, link: str | Path, scene: str = 'demo', rate: float = 1000.0, batch: int = 5, seed: int = 0, format: str = 'binary'):
        if not 0 < batch <= LARGEST or format not in ('binary', 'csv'):
            raise BadArgument(f'emulator: batch {batch} must be 1 to {LARGEST}, format {format!r} binary or csv')
        self._scene, self._format = open_psd_scene(scene, rate, seed), format
        self.bits = self._scene.electronics.bits
        self._made, self._made_at = np.zeros((0, CHANNELS), np.uint16), 0
        super().__init__(link, rate, batch, seed)

    def _encoded(self, frame: CountFrame) -> bytes:
        if self._format == 'binary':
            return super()._encoded(frame)
        return b''.join(write_line(counts.tolist(), frame.time_us + int(k * 1e6 / self._rate)) for k, counts in enumerate(frame.values))

    def _counts(self) -> np.ndarray:
        """Counts (batch, 4 or 5) of the next frame, simulated for many frames at once."""
        first = self._number - self._made_at
        if not 0 <= first <= len(self._made) - self._batch:
            self._made, self._made_at, first = self._play(self._number, self._batch * DRIVER.emulated_batch), self._number, 0
        return self._made[first:first + self._batch]

    def _play(self, first: int, count: int) -> np.ndarray:
        if not self.modulation:
            return self._scene.play(first, count)[0]
        lit = (first + np.arange(count)) % 2 == 0
        return np.column_stack([self._scene.play(first, count, lit)[0], lit.astype(np.uint16)])


class TaxelEmulator(PortEmulator):
    """Plays a scene of the simulated array.

    shape: (rows, columns); the simulated matrix is repeated or cut to it; bits: 8 to 16. Raises BadArgument for a shape, bits or rate out
    of range.
    """

    def __init__(self, link: str | Path, scene: str = 'demo', rate: float = 100.0, seed: int = 0, shape: tuple[int, int] = (44, 44),
                 bits: int = 8):
        if not (0 < min(shape) <= max(shape) <= LARGEST and 8 <= bits <= 16 and rate > 0):
            raise BadArgument(f'emulator: {shape[0]} x {shape[1]} must be 1 to {LARGEST}, {bits} bits 8 to 16, {rate} Hz more than 0')
        self._shape, self.bits = shape, bits
        self._scene = open_taxel_scene(scene, DRIVER.emulated_rate, seed)
        self._made, self._made_at = self._scene.render(0.0)[0], 0
        super().__init__(link, rate, 1, seed)

    def _counts(self) -> np.ndarray:
        number = int(self._number * DRIVER.emulated_rate / self._rate)
        if number != self._made_at:
            self._made, self._made_at = self._scene.render(number / DRIVER.emulated_rate)[0], number
        values = np.resize(self._made, self._shape) if self._made.shape != self._shape else self._made
        return values.astype(np.uint16) << (self.bits - 8)


def emulator_parser(prog: str, text: str, link: str, rate: float) -> argparse.ArgumentParser:
    """The arguments of an emulator's command."""
    parser = argparse.ArgumentParser(prog=prog, description=text)
    parser.add_argument('--link', default=link, help='symbolic link to the pseudo-terminal: what the driver opens as device')
    parser.add_argument('--scene', default='demo')
    parser.add_argument('--rate', type=float, default=rate, help='samples or frames per second')
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
    for line in sys.stdin:
        try:
            if line.strip():
                emulator.fault(line.strip())
        except BadArgument as error:
            print(error, flush=True)


@reports_errors('psd_emulator')
def psd_emulator(args: list[str] | None = None) -> int:
    """The command psd_emulator. Returns the exit code."""
    parser = emulator_parser('psd_emulator', 'Emulates the firmware of a PSD finger on a pseudo-terminal.', 'psd_finger_port', 1000.0)
    parser.add_argument('--batch', type=int, default=5, help='samples a frame')
    parser.add_argument('--format', default='binary', choices=('binary', 'csv'))
    parser.add_argument('--modulation', action='store_true',
                        help="the finger's light is on in every second sample; a fifth column indicates which")
    given = parser.parse_args(args)
    emulator = PsdEmulator(given.link, given.scene, given.rate, given.batch, given.seed, given.format)
    emulator.modulation = given.modulation
    return serve(emulator)


@reports_errors('taxel_emulator')
def taxel_emulator(args: list[str] | None = None) -> int:
    """The command taxel_emulator. Returns the exit code."""
    parser = emulator_parser('taxel_emulator', 'Emulates the firmware of a taxel array on a pseudo-terminal.', 'taxel_array_port', 100.0)
    parser.add_argument('--rows', type=int, default=44)
    parser.add_argument('--columns', type=int, default=44)
    parser.add_argument('--bits', type=int, default=8)
    given = parser.parse_args(args)
    return serve(TaxelEmulator(given.link, given.scene, given.rate, given.seed, (given.rows, given.columns), given.bits))
