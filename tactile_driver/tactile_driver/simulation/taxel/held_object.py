# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""An object between two like fingers, of which a simulated taxel pad is one: how far it slides follows from how hard it is gripped."""
from __future__ import annotations

import math

import numpy as np

from .pad import PadSpecimen
from .scene import STEP_S, Key, TaxelScene, TaxelScript
from ..truth import TruthFrame

_FACE, _AREA = 'bar', 24e-3 * 10e-3  # m^2, of that face
_PUT, _TAKEN, _END = 0.5, 5.5, 6.5  # s: when the object is between the fingers, and the round
_PULL = ((1.5, 0.0), (2.5, 3.0), (5.0, 3.0), (5.3, 0.0))  # (s, N): this finger's part of what pulls the object along the pad's y
_TOUCH = 1.5  # N, of fingers that just stand on the object
_LOST = 6e-3  # m: an object that has slid so far has left the fingers


class HeldScene(TaxelScene):
    """A round: the object is put between the fingers, pulled ever harder, and taken away.

    grip: N, that the gripper adds to the fingers' touch; it may be set between frames. slid: m, how far the object is from where it was
    put; lost: whether it has left the fingers in this round. rate, seed: as of TaxelScene.
    """

    def __init__(self, rate: float = 100.0, seed: int = 0, specimen: PadSpecimen = PadSpecimen()):
        self.grip = 0.0
        # Half a step takes off half of what pull and friction differ by: twice as fast as that would swing.
        self._damping = 2 * STEP_S * specimen.pull * _AREA
        super().__init__(TaxelScript(_FACE, (Key(0.0, 0, 0, 0, -1.0), Key(_END, 0, 0, 0, -1.0))), rate, seed, specimen)

    def _begin(self) -> None:
        super()._begin()
        self.slid, self.lost, self._before_y, self._held_by = 0.0, False, 0.0, 0.0

    @property
    def time(self) -> float:
        """Of the last frame in its round, s."""
        return self._now

    def pull(self, time: float) -> float:
        """N, at a time of the round, s."""
        return float(np.interp(time, *zip(*_PULL)))

    def _step(self, time: float, seconds: float) -> np.ndarray:
        """(4,) x, y, turn, depth after so many s more: the object follows the pull that friction leaves over."""
        if self.lost or not _PUT <= time < _TAKEN:
            return np.array([0.0, self.slid, 0.0, -1.0])
        self.slid += seconds * (self.pull(time) - self._held_by) / self._damping
        self.lost = abs(self.slid) > _LOST
        return np.array([0.0, self.slid, 0.0, (_TOUCH + self.grip) / (self.specimen.press * _AREA)])

    def render(self, time: float) -> tuple[np.ndarray, TruthFrame]:
        """As TaxelScene."""
        time = time % self.duration
        if time < self._now:
            self._begin()
        begin, steps = self._now, max(math.ceil((time - self._now) / STEP_S - 1e-6), 1)
        slipped, self._before_y = np.zeros(len(self.pad.places), bool), self.slid
        for k in range(1, steps + 1):
            place = self._step(begin + (time - begin) * k / steps, (time - begin) / steps)
            state = self.pad.move(self._face, place[:3], place[3])
            self._held_by = float(state.tilt[:, 1].sum()) * self.specimen.pull * self.pad.cell
            slipped |= state.slipping
        self._now = time
        return self._ink.read(self.pad.felt(state)), self._truth(state, slipped, place, time)

    def _at(self, time: float) -> np.ndarray:
        """(4,) where the object was one frame ago, which is all that TaxelScene asks for."""
        return np.array([0.0, self._before_y, 0.0, 0.0])
