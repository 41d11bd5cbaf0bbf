# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""An object between two equal fingers, one of them a simulated taxel pad: the grip force determines how far it slides."""
from __future__ import annotations

import math

import numpy as np

from .pad import PadSpecimen
from .scene import STEP_S, Key, TaxelScene, TaxelScript
from ..truth import TruthFrame

# All constants are chosen.
_FACE, _AREA = 'bar', 24e-3 * 10e-3  # face and its area, m^2
_PUT, _TAKEN, _END = 0.5, 5.5, 6.5  # s: object inserted, object removed, end of the round
_PULL = ((1.5, 0.0), (2.5, 3.0), (5.0, 3.0), (5.3, 0.0))  # (s, N): this finger's share of the force that pulls the object along the pad's y
_TOUCH = 1.5  # N, force of fingers that just touch the object
_LOST = 6e-3  # m: slide at which the object leaves the fingers


class HeldScene(TaxelScene):
    """In each round the object is inserted between the fingers, pulled with increasing force, and removed.

    grip: N, added by the gripper to the touch force; may be set between frames; slid: m, distance from the place of insertion; lost:
    whether the object has left the fingers in this round; rate, seed: as in TaxelScene.
    """

    def __init__(self, rate: float = 100.0, seed: int = 0, specimen: PadSpecimen = PadSpecimen()):
        self.grip = 0.0
        # Derived: each step halves the difference of pull and friction; a step that overcompensated it would oscillate.
        self._damping = 2 * STEP_S * specimen.pull * _AREA
        super().__init__(TaxelScript(_FACE, (Key(0.0, 0, 0, 0, -1.0), Key(_END, 0, 0, 0, -1.0))), rate, seed, specimen)

    def _begin(self) -> None:
        super()._begin()
        self.slid, self.lost, self._before_y, self._held_by = 0.0, False, 0.0, 0.0

    @property
    def time(self) -> float:
        """Time of the last frame in its round, s."""
        return self._now

    def pull(self, time: float) -> float:
        """Pulling force, N, at a time of the round, s."""
        return float(np.interp(time, *zip(*_PULL)))

    def _step(self, time: float, seconds: float) -> np.ndarray:
        """Pose (4,) after a step of seconds: the object moves by the difference of pull and friction."""
        if self.lost or not _PUT <= time < _TAKEN:
            return np.array([0.0, self.slid, 0.0, -1.0])
        self.slid += seconds * (self.pull(time) - self._held_by) / self._damping
        self.lost = abs(self.slid) > _LOST
        return np.array([0.0, self.slid, 0.0, (_TOUCH + self.grip) / (self.specimen.press * _AREA)])

    def render(self, time: float) -> tuple[np.ndarray, TruthFrame]:
        """As TaxelScene.render."""
        time = time % self.duration
        if time < self._now:
            self._begin()
        begin, steps = self._now, max(math.ceil((time - self._now) / STEP_S - 1e-6), 1)
        slipped, self._before_y = np.zeros(len(self.pad.places), bool), self.slid
        for k in range(1, steps + 1):
            place = self._step(begin + (time - begin) * k / steps, (time - begin) / steps)
            state = self.pad.move(self._face, place[:3], place[3])
            self._held_by = float(state.traction[:, 1].sum()) * self.pad.cell
            slipped |= state.slipping
        self._now = time
        return self._ink.read(self.pad.felt(state)), self._truth(state, slipped, place, time)

    def _at(self, time: float) -> np.ndarray:
        """Pose (4,) of the object one frame ago, the only one that TaxelScene needs."""
        return np.array([0.0, self._before_y, 0.0, 0.0])
