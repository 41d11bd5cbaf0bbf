# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated sensor with one camera, with the truth about every frame."""
from __future__ import annotations

from ..errors import BadArgument
from ..frame import CameraCalibration, Frame, PairFrame, pinhole_calibration
from ..simulation import scenes
from .pacing import NS, EvenPace, stamp_of, wait_until
from .protocol import Clock

_RATE = 30.0
_SIZE = (640, 480)
_LONGEST_LEAP = 2


class SimulatedSource:
    """A scene of a simulated sensor in real time, again from its start when it is over.

    scene: its name; rate: Hz, or -1 for 30; seed: of noise and specimen; size: (width, height), px, 0 for 640 x 480; clock: ns for the
    stamps. While its frames are not wanted the scene stands still: nothing is computed that nobody sees.
    """

    live = True
    on_demand = False

    def __init__(self, scene: str, rate: float, seed: int, size: tuple[int, int], clock: Clock):
        if rate == 0:
            raise BadArgument('rate: source sim runs in real time, 0 is no rate; give one in Hz, or -1 for 30 Hz')
        self.corrupt = 0
        self.rate = rate if rate > 0 else _RATE
        self._name, self._seed, self._clock = scene, seed, clock
        self._size = (size[0] or _SIZE[0], size[1] or _SIZE[1])
        self._scene = self._pace = None
        self._number = 0

    @property
    def skipped(self) -> int:
        """Frames that were due before the one in front of them was rendered."""
        return self._pace.skipped if self._pace else 0

    def open(self) -> None:
        """Set the scene up at its start. Raises BadArgument, listing the scenes, for an unknown one."""
        self._scene = self._open_scene()
        self._pace = EvenPace(self.rate, skip=True)
        self._number = 0

    def _open_scene(self):
        return scenes.open_scene(self._name, self.rate, self._seed, *self._size)

    def _frame(self, rendered, stamp_ns: int) -> Frame | PairFrame:
        return Frame(rendered.image, stamp_ns, 'bgr8', rendered.truth)

    def read(self, wanted: bool = True) -> Frame | PairFrame | None:
        """The next frame, rendered ahead and handed over at the instant that it shows."""
        skipped = self._pace.skipped
        due = self._pace.next()
        if not wanted:
            wait_until(due)
            return None
        # Frames missed have to be computed too, only not drawn: to catch up after a long stall would make the next one longer.
        self._number += min(self._pace.skipped - skipped, _LONGEST_LEAP)
        rendered = self._scene.render(self._number / self.rate)
        self._number += 1
        wait_until(due)
        return self._frame(rendered, stamp_of(due, self._clock))

    def close(self) -> None:
        """Let the scene go."""
        self._scene = None

    def describe(self) -> dict:
        """The scene, its seed, size and rate."""
        about = {'source': 'sim', 'device': 'simulated', 'scene': self._name, 'seed': self._seed, 'rate': self.rate}
        if self._scene is not None:
            about.update(device=f'simulated {self._scene.sensor}', width=self._scene.camera.width, height=self._scene.camera.height)
        return about

    def calibration(self) -> CameraCalibration | None:
        """The simulated camera's own."""
        return None if self._scene is None else _calibration_of(self._scene.camera)


class DualSimulatedSource(SimulatedSource):
    """A scene of a simulated sensor with two cameras, of which the right one is triggered a little later. Parameters as of SimulatedSource,
    without a size."""

    remark = ''

    def __init__(self, scene: str, rate: float, seed: int, clock: Clock):
        super().__init__(scene, rate, seed, (0, 0), clock)

    def _open_scene(self):
        return scenes.open_dual_scene(self._name, self.rate, self._seed)

    def _frame(self, rendered, stamp_ns: int) -> PairFrame:
        left, right, truth = rendered
        later = stamp_ns + int(self._scene.trigger_delay * NS)
        return PairFrame(Frame(left, stamp_ns, 'bgr8'), Frame(right, later, 'bgr8'), truth)

    def calibrations(self) -> tuple[CameraCalibration | None, CameraCalibration | None]:
        """The simulated cameras' own."""
        return (None, None) if self._scene is None else tuple(_calibration_of(camera) for camera in self._scene.cameras)


def _calibration_of(camera) -> CameraCalibration:
    return pinhole_calibration(camera.matrix, camera.distortion, (camera.width, camera.height))
