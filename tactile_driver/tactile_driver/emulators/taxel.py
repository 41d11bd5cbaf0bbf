# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""taxel_emulator: emulates the firmware of a taxel array, faults of the link included, on a pseudo-terminal."""
from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from ..command import tells_errors
from ..errors import BadArgument
from .port import PortEmulator, emulator_parser, serve
from ..serial.frames import CountFrame, LARGEST, MATRIX, write_frame
from ..simulation.taxel.scene import open_taxel_scene

_SCENE_RATE = 50.0  # simulated frames/s; a faster device sends each several times; chosen


class TaxelEmulator(PortEmulator):
    """Plays a scene of the simulated array at rate frames/s.

    shape: (rows, columns); the simulated matrix is repeated or cut to it; bits: 8 to 16; keep: record every frame in sent, as
    (sequence, matrix). Raises BadArgument for a shape, bits or rate out of range.
    """

    def __init__(self, link: str | Path, scene: str = 'demo', rate: float = 100.0, seed: int = 0, shape: tuple[int, int] = (44, 44),
                 bits: int = 8, keep: bool = False):
        if not (0 < min(shape) <= max(shape) <= LARGEST and 8 <= bits <= 16 and rate > 0):
            raise BadArgument(f'emulator: {shape[0]} x {shape[1]} must be 1 to {LARGEST}, {bits} bits 8 to 16, {rate} Hz more than 0')
        self.sent = [] if keep else None
        self._shape, self._bits = shape, bits
        self._scene = open_taxel_scene(scene, _SCENE_RATE, seed)
        self._made, self._made_at = self._scene.render(0.0)[0], 0
        super().__init__(link, rate, 1, seed)

    def _frame(self) -> bytes:
        number = int(self._number * _SCENE_RATE / self._rate)
        if number != self._made_at:
            self._made, self._made_at = self._scene.render(number / _SCENE_RATE)[0], number
        values = np.resize(self._made, self._shape) if self._made.shape != self._shape else self._made
        values = values.astype(np.uint16) << (self._bits - 8)
        time_us = int((self._number - self._zero) * 1e6 / self._rate)
        if self.sent is not None:
            self.sent.append((self._sequence, values))
        data = write_frame(CountFrame(values, time_us, 0, self._sequence, self._bits), MATRIX)
        self._number, self._sequence = self._number + 1, self._sequence + 1
        return data


@tells_errors('taxel_emulator')
def main(args: list[str] | None = None) -> int:
    """The command taxel_emulator. Returns the exit code."""
    parser = emulator_parser('taxel_emulator', __doc__, 'taxel_array_port', 100.0)
    parser.add_argument('--rows', type=int, default=44)
    parser.add_argument('--columns', type=int, default=44)
    parser.add_argument('--bits', type=int, default=8)
    given = parser.parse_args(args)
    shape = given.rows, given.columns
    return serve(TaxelEmulator(given.link, given.scene, given.rate, given.seed, shape, given.bits))


if __name__ == '__main__':
    sys.exit(main())
