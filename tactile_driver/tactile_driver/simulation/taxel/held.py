# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes of a bar that two fingers with such pads hold while an arm turns them: weight and pushes are balanced by what the pads carry."""
from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ...errors import by_name
from ..constants import SIMULATION
from .pad import PadState
from .scene import Key, TaxelScene, TaxelScript

# Part of the load that is not yet balanced by which the bar moves in a step: friction is stiffer than an even traction, by less than three
# times, since the rubber around the face holds it: below the reciprocal of that.
_GAIN = np.array([0.3, 0.3, 0.3, 0.6, 0.6, 0.6])


@dataclass(frozen=True)
class HeldKey:
    """State of arm and gripper at a time, s.

    depth : m, by which the closed fingers indent each pad without a load.
    lift : part of the weight that the fingers carry, the rest stands on a table.
    turn, rise : rad; gravity is (sin turn cos rise, cos turn cos rise, -sin rise) in the sensor frame.
    push_x, push_y : N m, moments about x and y with which something pushes the bar on this pad.
    """

    time: float
    depth: float
    lift: float = 1.0
    turn: float = 0.0
    rise: float = 0.0
    push_x: float = 0.0
    push_y: float = 0.0


@dataclass(frozen=True)
class HeldScript:
    """keys: in order of time, linearly interpolated; weight: N; off_centre: m, of the centre of mass from the middle of the face, along
    the bar; angle: rad, of the bar on the pad."""

    keys: tuple[HeldKey, ...]
    weight: float = 3.0
    off_centre: float = 0.006
    angle: float = 0.3


_GRASP = HeldKey(0.0, -1e-4, 0.0), HeldKey(0.5, -1e-4, 0.0), HeldKey(1.0, 3e-4, 0.0), HeldKey(1.4, 3e-4, 0.0), HeldKey(1.8, 3e-4)


def _after(begin: float, poses: tuple[tuple[float, ...], ...], move: float = 0.6, hold: float = 0.5) -> tuple[HeldKey, ...]:
    """Each of poses, of a HeldKey without time and lift, reached within move, s, and held for hold, s."""
    keys = []
    for depth, *more in poses:
        keys += [HeldKey(begin + move, depth, 1.0, *more), HeldKey(begin + move + hold, depth, 1.0, *more)]
        begin += move + hold
    return tuple(keys)


HELD_SCENES: dict[str, HeldScript] = {
    # postures of the arm, as it turns the bar about the pads' normal and raises one finger above the other, and a firmer grip
    'postures': HeldScript((*_GRASP, *_after(2.2, (
        (3e-4, 0.8), (3e-4, 1.57), (4e-4, 1.57), (4e-4, 0.8, 0.6), (4e-4, 0.0, 1.2), (3e-4, 0.0, 0.0), (3e-4, -0.8, -0.6),
        (3e-4, 0.0, -1.2), (3e-4, 0.0, 0.0))))),
    # the bar is pushed, so that it tilts on the pads
    'pushed': HeldScript((*_GRASP, *_after(2.2, (
        (3e-4, 0.0, 0.0, 4e-3, 0.0), (3e-4, 0.0, 0.0, 0.0, 0.02), (3e-4, 0.8, 0.4, 0.0, -0.02), (3e-4, 0.8, 0.4, -4e-3, 0.01),
        (3e-4, 0.0)))))}


class HeldScene(TaxelScene):
    """Plays a HeldScript. rate: frames/s; seed: of the irregularities of the specimen and the noise."""

    def __init__(self, script: HeldScript, rate: float, seed: int):
        self.script = script
        self._table = np.array([[getattr(key, field.name) for field in fields(key)] for key in script.keys])
        super().__init__(TaxelScript('bar', tuple(Key(key.time, 0.0, 0.0, script.angle, key.depth) for key in script.keys)), rate, seed)

    def arm(self, time: float) -> HeldKey:
        """State of arm and gripper at a time, s."""
        return HeldKey(time, *(float(np.interp(time, self._table[:, 0], column)) for column in self._table.T[1:]))

    @property
    def centre_of_mass(self) -> np.ndarray:
        """(2,) m along the pad, from the middle of the face, which is that of the sensor frame but for the skin's give."""
        return self.script.off_centre * np.array([np.cos(self.script.angle), np.sin(self.script.angle)])

    @staticmethod
    def gravity(arm: HeldKey) -> np.ndarray:
        """Unit vector (3,) of gravity in the sensor frame."""
        return np.array([np.sin(arm.turn) * np.cos(arm.rise), np.cos(arm.turn) * np.cos(arm.rise), -np.sin(arm.rise)])

    def _begin(self) -> None:
        super()._begin()
        self._given = np.zeros(6)  # x, y (m), turn (rad), depth (m), slopes, by which the bar moves until the loads are balanced

    def _at(self, time: float) -> np.ndarray:
        return super()._at(time) + self._given

    def _step(self, time: float) -> tuple[PadState, np.ndarray]:
        state, pose = super()._step(time)
        arm, pad = self.arm(time), self.specimen
        if arm.lift > 0:
            area = SIMULATION.bar_length * SIMULATION.bar_width
            weight = 0.5 * arm.lift * self.script.weight * self.gravity(arm)
            wanted = np.zeros(6)
            wanted[:3] = weight - [0.0, 0.0, pad.press * area * arm.depth]
            wanted[3:] = np.cross([*self.centre_of_mass, 0.0], weight) + [arm.push_x, arm.push_y, 0.0]
            carried = self.pad.force(state)
            carried[3:] -= np.cross([*pose[:2], -pose[3]], carried[:3])
            missing = wanted - carried
            # About the bar's own axes; a slope along x makes a moment about y, one along y a moment about x of the other sign.
            cosine, sine = np.cos(pose[2]), np.sin(pose[2])
            axes = np.array([[cosine, sine], [-sine, cosine]])
            along, across = pad.press * area / 12 * np.array([SIMULATION.bar_length**2, SIMULATION.bar_width**2])
            slopes = axes.T @ (axes @ [-missing[4], missing[3]] / [along, across])
            polar = area / 12 * (SIMULATION.bar_length**2 + SIMULATION.bar_width**2)  # m^4, second moment of the face
            self._given += _GAIN * [*missing[:2] / (pad.pull * area), missing[5] / (pad.pull * polar),
                                    -missing[2] / (pad.press * area), *slopes]
        return state, pose


def open_held_scene(name: str, rate: float, seed: int = 0) -> HeldScene:
    """The scene of that name. Raises BadArgument for an unknown name (the message lists the known ones)."""
    return HeldScene(by_name(HELD_SCENES, name, 'simulation: scene'), rate, seed)
