# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated PSD finger, with the truth about every sample."""
from __future__ import annotations

import time

import numpy as np

from ..errors import BadArgument
from ..samples import SampleBlock
from ..simulation.psd_scene import open_psd_scene
from .pacing import NS, EvenPace, stamp_of, wait_until
from .protocol import Clock

_RATE = 1000.0
_LONGEST_LEAP = 5  # batches


class PsdSimulatedSource:
    """A scene of the simulated finger in real time, again from its start when it is over.

    rate: samples/s, or -1 for 1000; seed: of noise and specimen; batch_period: s; clock: ns for the stamps. A batch is handed over when
    its last sample is due.
    """

    live, on_demand = True, False

    def __init__(self, scene: str, rate: float, seed: int, batch_period: float, clock: Clock):
        if rate == 0:
            raise BadArgument('rate: source sim runs in real time, 0 is no rate; give one in Hz, or -1 for 1000 Hz')
        self.corrupt = 0
        self.rate = rate if rate > 0 else _RATE
        self._count = max(round(batch_period * self.rate), 1)
        self._name, self._seed, self._clock = scene, seed, clock
        self._scene = self._pace = None
        self._number = 0

    @property
    def skipped(self) -> int:
        """Samples that were due before the batch in front of them was made."""
        return self._pace.skipped * self._count if self._pace else 0

    def open(self) -> None:
        """Set the scene up at its start. Raises BadArgument, listing the scenes, for an unknown one."""
        self._scene = open_psd_scene(self._name, self.rate, self._seed)
        self._pace = EvenPace(self.rate / self._count, skip=True)
        self._number = 0

    def read(self, wanted: bool = True) -> SampleBlock | None:
        """The next batch, at the instant of its last sample; while it is not wanted the scene stands still."""
        skipped = self._pace.skipped
        due = self._pace.next()
        if not wanted:
            wait_until(due)
            return None
        self._number += self._count * min(self._pace.skipped - skipped, _LONGEST_LEAP)
        counts, truth = self._scene.play(self._number, self._count)
        self._number += self._count
        electronics = self._scene.electronics
        volts = counts.astype(np.float32) * np.float32(electronics.full_scale / 2**electronics.bits)
        wait_until(due)
        first = due - round((self._count - 1) / self.rate * NS)
        return SampleBlock(volts, stamp_of(min(first, time.monotonic_ns()), self._clock), 1 / self.rate, truth)

    def close(self) -> None:
        """Let the scene go."""
        self._scene = None

    def describe(self) -> dict:
        """The scene, its seed and rate."""
        return {'source': 'sim', 'device': 'simulated psd_finger', 'scene': self._name, 'seed': self._seed, 'rate': self.rate}

    remark = ''

    def calibration(self) -> None:
        """None: there is no camera."""
