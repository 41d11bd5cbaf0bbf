# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated PSD finger, with the truth about every sample."""
from __future__ import annotations

import time

import numpy as np

from ..base.pacing import NS
from ..base.protocol import Clock
from ..base.scene_source import SceneSource
from ...samples import SampleBlock
from ...simulation.psd.scene import open_psd_scene


class PsdSimulatedSource(SceneSource):
    """A scene of the simulated finger; a step is a sample. batch_period: s of samples per block, returned when its last sample is due; the
    rest as in SceneSource.
    """

    truths = ('contacts',)
    usual_rate = 1000.0
    longest_leap = 5

    def __init__(self, scene: str, rate: float, seed: int, batch_period: float, clock: Clock):
        super().__init__(scene, rate, seed, clock, max(round(batch_period * self.rate_of(rate)), 1))

    def _open_scene(self):
        return open_psd_scene(self._name, self.rate, self._seed)

    def _make(self, number: int):
        counts, truth = self._scene.play(number, self._count)
        electronics = self._scene.electronics
        return counts.astype(np.float32) * np.float32(electronics.full_scale / 2**electronics.bits), truth

    def _handed_over(self, made, due_ns: int) -> SampleBlock:
        volts, truth = made
        first = due_ns - round((self._count - 1) / self.rate * NS)
        return SampleBlock(volts, self._stamp(min(first, time.monotonic_ns())), 1 / self.rate, truth)

    def describe(self) -> dict:
        """The scene, its seed and rate."""
        return super().describe() | {'device': 'simulated psd_finger'}
