# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated taxel array, with the truth about every frame."""
from __future__ import annotations

from ..errors import BadArgument
from ..frame import Frame
from ..matrix import matrix_frame
from ..simulation.taxel_scene import open_taxel_scene
from .pacing import EvenPace, stamp_of, wait_until
from .protocol import Clock

_RATE = 100.0
_LONGEST_LEAP = 5


class TaxelSimulatedSource:
    """A scene of the simulated array in real time, again from its start when it is over.

    rate: frames/s, or -1 for 100; seed: of noise and specimen; clock: ns for the stamps. While its frames are not wanted it stands still.
    """

    live, on_demand = True, False
    remark = ''

    def __init__(self, scene: str, rate: float, seed: int, clock: Clock):
        if rate == 0:
            raise BadArgument('rate: source sim runs in real time, 0 is no rate; give one in Hz, or -1 for 100 Hz')
        self.corrupt = 0
        self.rate = rate if rate > 0 else _RATE
        self._name, self._seed, self._clock = scene, seed, clock
        self._scene = self._pace = None
        self._number = 0

    @property
    def skipped(self) -> int:
        """Frames that were due before the one in front of them was made."""
        return self._pace.skipped if self._pace else 0

    def open(self) -> None:
        """Set the scene up at its start. Raises BadArgument, listing the scenes, for an unknown one."""
        self._scene = open_taxel_scene(self._name, self.rate, self._seed)
        self._pace = EvenPace(self.rate, skip=True)
        self._number = 0

    def read(self, wanted: bool = True) -> Frame | None:
        """The next frame, at the instant that it shows."""
        skipped = self._pace.skipped
        due = self._pace.next()
        if not wanted:
            wait_until(due)
            return None
        self._number += min(self._pace.skipped - skipped, _LONGEST_LEAP)
        values, truth = self._scene.render(self._number / self.rate)
        self._number += 1
        wait_until(due)
        return matrix_frame(values, (0, 0), stamp_of(due, self._clock), 'the simulated frame', truth)

    def close(self) -> None:
        """Let the scene go."""
        self._scene = None

    def describe(self) -> dict:
        """The scene, its seed and rate."""
        return {'source': 'sim', 'device': 'simulated taxel_array', 'scene': self._name, 'seed': self._seed, 'rate': self.rate}

    def calibration(self) -> None:
        """None: there is no camera."""
