# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""psd_emulator: emulates the firmware of a PSD finger, faults of the link included, on a pseudo-terminal."""
from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from ..command import tells_errors
from ..errors import BadArgument
from .port import PortEmulator, emulator_parser, serve
from ..samples import CHANNELS
from ..serial.frames import CountFrame, SAMPLES, write_frame, write_line
from ..simulation.psd.scene import open_psd_scene
from ..sources.source import NS

_FRAMES_AT_ONCE = 50  # frames simulated per call, which is faster than one by one; chosen


class Emulator(PortEmulator):
    """Plays a scene of the simulated finger at rate samples/s, batch samples in a frame.

    link: path of a symbolic link to the port, which survives unplugging; format: binary or csv; keep: record every sample in sent, as
    (device time in us, counts (4,)); modulation: the finger's light is on in every second sample only, and a fifth column tells which.
    Raises BadArgument for a batch outside 1 to 256 or another format.
    """

    def __init__(self, link: str | Path, scene: str = 'demo', rate: float = 1000.0, batch: int = 5, seed: int = 0, format: str = 'binary',
                 keep: bool = False, modulation: bool = False):
        if not 0 < batch <= 256 or format not in ('binary', 'csv'):
            raise BadArgument(f'emulator: batch {batch} must be 1 to 256, format {format!r} binary or csv')
        self.sent = [] if keep else None
        self._scene, self._format = open_psd_scene(scene, rate, seed), format
        self._modulation = modulation
        self._made, self._made_at = np.zeros((0, CHANNELS), np.uint16), 0
        super().__init__(link, rate, batch, seed)

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
        """Counts (batch, 4 or 5) of the next frame, simulated for many frames at once."""
        first = self._number - self._made_at
        if not 0 <= first <= len(self._made) - self._batch:
            self._made, self._made_at, first = self._play(self._number, self._batch * _FRAMES_AT_ONCE), self._number, 0
        return self._made[first:first + self._batch]

    def _play(self, first: int, count: int) -> np.ndarray:
        if not self._modulation:
            return self._scene.play(first, count)[0]
        lit = (first + np.arange(count)) % 2 == 0
        return np.column_stack([self._scene.play(first, count, lit)[0], lit.astype(np.uint16)])


@tells_errors('psd_emulator')
def main(args: list[str] | None = None) -> int:
    """The command psd_emulator. Returns the exit code."""
    parser = emulator_parser('psd_emulator', __doc__, 'psd_finger_port', 1000.0)
    parser.add_argument('--batch', type=int, default=5, help='samples a frame')
    parser.add_argument('--format', default='binary', choices=('binary', 'csv'))
    parser.add_argument('--modulation', action='store_true',
                        help="the finger's light is on in every second sample; a fifth column tells which")
    given = parser.parse_args(args)
    return serve(Emulator(given.link, given.scene, given.rate, given.batch, given.seed, given.format, modulation=given.modulation))


if __name__ == '__main__':
    sys.exit(main())
