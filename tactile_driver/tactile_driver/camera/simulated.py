# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Simulated sensors with one or two cameras as sources, with ground truth for every frame."""
from __future__ import annotations

import math
import time

from ..frame import CameraCalibration, Frame, PairFrame, pinhole_calibration
from ..simulation.sensors import scenes
from ..sources.source import NS, Clock, SceneSource, wait_until

_SIZE = (640, 480)  # (width, height), px; the image size of the touchpad paper (touchpad_contact_region, section 2)
_AHEAD_S = 3.0  # of the scene that is computed ahead; chosen
_SPARE_NS = NS // 50  # time before a frame is due that one state of a touched skin may take; measured on the sheet with two cameras


class SimulatedSource(SceneSource):
    """A scene of a sensor with one camera. size: (width, height), px, 0 for 640 x 480; other parameters: as in SceneSource."""

    def __init__(self, scene: str, rate: float, seed: int, size: tuple[int, int], clock: Clock):
        super().__init__(scene, rate, seed, clock)
        self._size = (size[0] or _SIZE[0], size[1] or _SIZE[1])

    def _open_scene(self):
        return scenes.open_scene(self._name, self.rate, self._seed, *self._size)

    def _make(self, number: int):
        return self._scene.render(number / self.rate)

    def _compute_ahead(self, due_ns: int) -> None:
        # A touched skin takes longer than an untouched one, in drags longer than a period.
        while due_ns - time.monotonic_ns() > _SPARE_NS and self._scene.observe_ahead(self._number + round(_AHEAD_S * self.rate)):
            pass

    def _handed_over(self, made, due_ns: int) -> Frame:
        return Frame(made.image, self._stamp(due_ns), 'bgr8', made.truth)

    def describe(self) -> dict:
        """The scene, its seed, size and rate."""
        about = super().describe()
        if self._scene is not None:
            about.update(device=f'simulated {self._scene.sensor}', width=self._scene.camera.width, height=self._scene.camera.height)
        return about

    def calibration(self) -> CameraCalibration | None:
        """Calibration of the simulated camera; None before open."""
        return None if self._scene is None else _calibration_of(self._scene.camera)


class DualSimulatedSource(SimulatedSource):
    """A scene of a simulated sensor with two cameras, which expose at different times. Parameters as in SimulatedSource, without size."""

    offset_ms = math.nan

    def __init__(self, scene: str, rate: float, seed: int, clock: Clock):
        super().__init__(scene, rate, seed, (0, 0), clock)

    def _open_scene(self):
        return scenes.open_dual_scene(self._name, self.rate, self._seed)

    def _make(self, number: int):
        return *super()._make(number), round(self._scene.right_delay(number) * NS)

    def _handed_over(self, made, due_ns: int) -> PairFrame:
        left, right, truth, delay_ns = made
        wait_until(due_ns + delay_ns)
        stamp_ns = self._stamp(due_ns)
        self.offset_ms = 1e-6 * delay_ns
        return PairFrame(Frame(left, stamp_ns, 'bgr8'), Frame(right, stamp_ns + delay_ns, 'bgr8'), truth)

    def calibrations(self) -> tuple[CameraCalibration | None, CameraCalibration | None]:
        """Calibrations of the simulated cameras; None before open."""
        return (None, None) if self._scene is None else tuple(_calibration_of(camera) for camera in self._scene.cameras)


def _calibration_of(camera) -> CameraCalibration:
    return pinhole_calibration(camera.matrix, camera.distortion, (camera.width, camera.height))
