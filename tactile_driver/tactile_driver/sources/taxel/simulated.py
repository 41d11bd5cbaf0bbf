# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated taxel array, with the truth about every frame."""
from __future__ import annotations

from ..base.scene_source import SceneSource
from ...frame import Frame
from ...matrix import matrix_frame
from ...simulation.taxel.scene import open_taxel_scene


class TaxelSimulatedSource(SceneSource):
    """A scene of the simulated array; a step is a frame. Parameters as in SceneSource."""

    usual_rate = 100.0
    longest_leap = 5

    def _open_scene(self):
        return open_taxel_scene(self._name, self.rate, self._seed)

    def _make(self, number: int):
        return self._scene.render(number / self.rate)

    def _handed_over(self, made, due_ns: int) -> Frame:
        values, truth = made
        return matrix_frame(values, (0, 0), self._stamp(due_ns), 'the simulated frame', truth)

    def describe(self) -> dict:
        """The scene, its seed and rate."""
        return super().describe() | {'device': 'simulated taxel_array'}
