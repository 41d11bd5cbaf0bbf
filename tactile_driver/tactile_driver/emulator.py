# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""psd_emulator: a PSD finger's firmware on a pseudo-terminal, with the faults that real ones have."""
from __future__ import annotations

import argparse
import os
import sys
import threading
import time
import tty
from collections.abc import Callable
from pathlib import Path

import numpy as np

from .errors import BadArgument, TactileError
from .samples import CHANNELS
from .serial_frames.binary import SAMPLES, write_frame
from .serial_frames.counts import CountFrame
from .serial_frames.lines import write_line
from .simulation.psd_scene import open_psd_scene
from .sources.pacing import NS, wait_until

_GARBAGE, _DROPPED = 300, 40  # bytes
_PAUSE_S = 1.0
_LARGEST_BACKLOG_NS = 5 * 10**8  # what a busy machine may be late by without a gap in what the device sends
_FRAMES_AT_ONCE = 50


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


class Emulator:
    """Plays a scene of the simulated finger at rate samples/s, batch of them a frame, on a pseudo-terminal.

    link: path of a symbolic link to the port, which stays the same when it is unplugged; format: binary or csv; every sample sent is kept
    in sent where keep is set: (device us, counts (4,)).
    """

    def __init__(self, link: str | Path, scene: str = 'demo', rate: float = 1000.0, batch: int = 5, seed: int = 0, format: str = 'binary',
                 keep: bool = False):
        if not 0 < batch <= 256 or format not in ('binary', 'csv'):
            raise BadArgument(f'emulator: batch {batch} must be 1 to 256, format {format!r} binary or csv')
        self.link, self.sent = Path(link), [] if keep else None
        self._scene, self._rate, self._batch, self._format = open_psd_scene(scene, rate, seed), rate, batch, format
        self._rng, self._lock = np.random.default_rng(seed), threading.Lock()
        self._wanted: list[str] = []
        self._number = self._sequence = self._zero = 0
        self._made, self._made_at = np.zeros((0, CHANNELS), np.uint16), 0
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
        counts = self._counts()
        times = ((np.arange(self._batch) + self._number - self._zero) * (1e6 / self._rate)).astype(np.int64)
        if self.sent is not None:
            self.sent += [(int(t), c.tolist()) for t, c in zip(times, counts)]
        frame = CountFrame(counts, int(times[0]), round(NS / self._rate), self._sequence, self._scene.electronics.bits)
        self._number, self._sequence = self._number + self._batch, self._sequence + 1
        if self._format == 'binary':
            return write_frame(frame, SAMPLES)
        return b''.join(write_line(c.tolist(), int(t)) for t, c in zip(times, counts))

    def _counts(self) -> np.ndarray:
        """(batch, 4): made for many frames at once, which costs less."""
        first = self._number - self._made_at
        if not 0 <= first <= len(self._made) - self._batch:
            self._made, self._made_at, first = self._scene.play(self._number, self._batch * _FRAMES_AT_ONCE)[0], self._number, 0
        return self._made[first:first + self._batch]

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


def main(args: list[str] | None = None) -> int:
    """The command psd_emulator; exit code 0, or 1 with one line that says what is wrong."""
    parser = argparse.ArgumentParser(prog='psd_emulator', description=__doc__)
    parser.add_argument('--link', default='psd_finger_port', help='symbolic link to the pseudo-terminal: what psd_node opens as device')
    parser.add_argument('--scene', default='demo')
    parser.add_argument('--rate', type=float, default=1000.0, help='samples a second')
    parser.add_argument('--batch', type=int, default=5, help='samples a frame')
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--format', default='binary', choices=('binary', 'csv'))
    given = parser.parse_args(args)
    try:
        emulator = Emulator(given.link, given.scene, given.rate, given.batch, given.seed, given.format)
    except TactileError as error:
        print(f'psd_emulator: {error}', file=sys.stderr)
        return 1
    print(f'sending to {Path(given.link).absolute()}; type a fault and Enter: {", ".join(FAULTS)}', flush=True)
    threading.Thread(target=_listen, args=(emulator,), daemon=True).start()
    try:
        emulator.run(lambda: False)
    except KeyboardInterrupt:
        emulator.link.unlink(missing_ok=True)
    return 0


def _listen(emulator: Emulator) -> None:
    """Faults from the standard input, one a line."""
    for line in sys.stdin:
        try:
            if line.strip():
                emulator.fault(line.strip())
        except BadArgument as error:
            print(error, flush=True)


if __name__ == '__main__':
    sys.exit(main())
