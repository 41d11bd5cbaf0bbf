# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Simulated sensors with one or two cameras as sources, with ground truth for every frame."""
from __future__ import annotations

import time

from ..frame import CameraCalibration, Frame, PairFrame, pinhole_calibration
from ..simulation.sensors import scenes
from ..sources.source import NS, SceneSource, wait_until
from .constants import CAMERA


class SimulatedSource(SceneSource):
    """A scene of a sensor with one camera. values: as of SceneSource; width, height, px, 0 for 640 x 480."""

    def _open_scene(self, name: str, rate: float, seed: int):
        width, height = CAMERA.simulated_size
        return scenes.open_scene(name, rate, seed, self._values['width'] or width, self._values['height'] or height)

    @property
    def sensor(self) -> str:
        """See SceneSource; known once it is open."""
        return self._scene.sensor if self._scene is not None else ''

    def _make(self, number: int):
        return self._scene.render(number / self.rate)

    def _compute_ahead(self, due_ns: int) -> None:
        # A touched skin takes longer than an untouched one, in drags longer than a period.
        ahead = self._number + round(CAMERA.ahead_s * self.rate)
        while due_ns - time.monotonic_ns() > CAMERA.spare_ns and self._scene.observe_ahead(ahead):
            pass

    def _handed_over(self, made, due_ns: int) -> Frame | PairFrame:
        return Frame(made.image, self.stamp(due_ns), 'bgr8', made.truth)

    @property
    def _cameras(self) -> tuple:
        return (self._scene.camera,)

    def describe(self) -> dict:
        """The scene, its seed, size and rate."""
        size = {} if self._scene is None else {'width': self._cameras[0].width, 'height': self._cameras[0].height}
        return super().describe() | size

    def calibrations(self) -> tuple[CameraCalibration | None, ...]:
        """Calibrations of the simulated cameras; None before open."""
        if self._scene is None:
            return super().calibrations()
        return tuple(pinhole_calibration(camera.matrix, camera.distortion, (camera.width, camera.height)) for camera in self._cameras)


class DualSimulatedSource(SimulatedSource):
    """A scene of a simulated sensor with two cameras, which expose at different times."""

    _delay_ns = 0

    def _open_scene(self, name: str, rate: float, seed: int):
        return scenes.open_dual_scene(name, rate, seed)

    @property
    def _cameras(self) -> tuple:
        return self._scene.cameras

    def _make(self, number: int):
        return *super()._make(number), round(self._scene.right_delay(number) * NS)

    def _handed_over(self, made, due_ns: int) -> PairFrame:
        left, right, truth, self._delay_ns = made
        wait_until(due_ns + self._delay_ns)
        stamp_ns = self.stamp(due_ns)
        return PairFrame(Frame(left, stamp_ns, 'bgr8'), Frame(right, stamp_ns + self._delay_ns, 'bgr8'), truth)

    def describe(self) -> dict:
        """The scene, its seed, size and rate, and how much later the right camera exposes."""
        return super().describe() | {'shutter offset (ms)': 1e-6 * self._delay_ns}
