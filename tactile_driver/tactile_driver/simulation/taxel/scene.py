# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes of the simulated taxel pad with ground truth: objects that are pressed on and moved."""
from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np

from ...plugins import PluginTable
from ..constants import SIMULATION
from ..keyed_scene import KeyedScene, open_keyed_scene
from ..truth import NO_SLIP, Touch, TruthFrame, slip_state_of
from .pad import FACES, PAD, Ink, InkSpecimen, PadSpecimen, PadState, RubberPad


@dataclass(frozen=True)
class Key:
    """Pose of the object at a time, s: x, y (m), turn (rad), depth (m, negative: above the pad), tilt_x, tilt_y (slopes)."""

    time: float
    x: float
    y: float
    turn: float
    depth: float
    tilt_x: float = 0.0
    tilt_y: float = 0.0


@dataclass(frozen=True)
class TaxelScript:
    """face: name in FACES; keys: in order of time, linearly interpolated; dead_rows: of the array; smoothness: part of the pad's friction
    that is left on this object."""

    face: str
    keys: tuple[Key, ...]
    dead_rows: tuple[int, ...] = ()
    smoothness: float = 1.0


def _pressed(face: str, depths: Iterable[tuple[float, float]], x: float = 0.0, turn: float = 0.3, **more) -> TaxelScript:
    """An object that stays at x, m, is pressed to depths, (s, m)."""
    return TaxelScript(face, tuple(Key(time, x, 0.0, turn, depth) for time, depth in depths), **more)


def _dragged(face: str, dx: float, dy: float, turn: float) -> TaxelScript:
    """Pressed, held, then moved with increasing speed."""
    start, down = (-0.5 * dx, -0.5 * dy, 0.3 - 0.5 * turn), 3e-4
    keys = [Key(0.0, *start, -1e-4), Key(0.5, *start, -1e-4), Key(1.0, *start, down), Key(1.5, *start, down)]
    for time, part in ((2.1, 0.08), (2.7, 0.3), (3.3, 1.0)):
        keys.append(Key(time, start[0] + part * dx, start[1] + part * dy, start[2] + part * turn, down))
    keys += [replace(keys[-1], time=time, depth=depth) for time, depth in ((3.8, down), (4.2, -1e-4), (4.6, -1e-4))]
    return TaxelScript(face, tuple(keys))


def _moved(face: str, path: Iterable[tuple[float, float]], down: float = 3e-4, **more) -> TaxelScript:
    """Pressed, held, moved along x by path, (s, m) from 1.5 s on, and released."""
    keys = [Key(time, 0.0, 0.0, 0.3, depth) for time, depth in ((0.0, -1e-4), (0.5, -1e-4), (1.0, down), (1.5, down))]
    keys += [Key(1.5 + time, x, 0.3 * x, 0.3, down) for time, x in path]
    end = keys[-1]
    return TaxelScript(face, (*keys, *(Key(end.time + t, end.x, end.y, 0.3, -1e-4) for t in (0.2, 0.7))), **more)


def _tilted(face: str, tilts: tuple, down: float) -> TaxelScript:
    """Pressed, then tilted along x and y by (s, slope, slope), without slip, and released."""
    keys = [Key(time, 0.0, 0.0, 0.0, depth) for time, depth in ((0.0, -1e-4), (0.5, -1e-4), (1.0, down))]
    keys += [Key(1.0 + time, 0.0, 0.0, 0.0, down, x, y) for time, x, y in tilts]
    end = keys[-1].time
    return TaxelScript(face, (*keys, *(Key(end + t, 0.0, 0.0, 0.0, -1e-3) for t in (0.2, 0.7))))


def _plate(rest: float, after: float) -> TaxelScript:
    """A plate over all taxels, in steps up and down, after rest, s, and before after, s, without contact."""
    rising = [(rest + 0.3 + 0.6 * k, 1e-4 * (k // 2 + 1)) for k in range(8)]
    falling = [(rest + 5.1 + 0.6 * k, 1e-4 * (3 - k // 2)) for k in range(6)]
    steps = [(0.0, -1e-4), (rest, -1e-4), *rising, *falling, (rest + 8.7, -1e-4), (rest + 8.7 + after, -1e-4)]
    return _pressed('edge', steps, -0.05, 0.0)


_HELD = ((0.0, -1e-4), (0.5, -1e-4), (1.0, 3e-4), (3.0, 3e-4), (3.4, -1e-4), (4.0, -1e-4))
#: The object does not move; only the grip force changes.
_GRIP = ((0.0, -1e-4), (0.5, -1e-4), (1.0, 2e-4), (1.5, 2e-4), (2.0, 4e-4), (2.5, 4e-4), (3.2, 1.5e-4), (3.8, 3e-4), (4.2, -1e-4))

TAXEL_SCENES: Mapping[str, TaxelScript | Callable[[float, int], TaxelScene]] = PluginTable('tactile_driver.taxel_scenes', {
    'demo': _dragged('bar', 4e-3, 1e-3, 0.0),
    **{face: _pressed(face, _HELD) for face in FACES},
    'rest': _pressed('bar', ((0.0, -1e-4), (3.0, -1e-4)), turn=0.0),
    'drag': _dragged('disc', -3e-3, 3e-3, 0.0),
    'turn': _dragged('bar', 0.0, 0.0, 0.8),
    'grip': _pressed('bar', _GRIP),
    'dead_rows': _pressed('disc', _HELD, dead_rows=(17, 25)),
    'smooth': _moved('bar', ((0.0, 0.0), (1.0, 3e-3)), smoothness=0.25),
    'cycle': _moved('bar', ((0.3 * k, 1e-4 * (0, 1, 0, -1)[k % 4]) for k in range(9))),
    'jerks': _moved('disc', ((0.25 * k, 2.5e-4 * (k // 4 * 4 + (0, 3, 3, 2)[k % 4])) for k in range(13))),
    'roll': _tilted('roller', ((0.3, 0, 0), (1.3, 0.12, 0), (2.3, -0.12, 0), (2.8, 0, 0)), 5e-4),
    'slide': _moved('sphere', ((0.0, 0.0), (0.8, 2.5e-3)), down=7e-4),
    'rock': _tilted('edge', ((0.3, 0, 0), (1.3, 0.01, 0.004), (2.3, 0.02, -0.01), (3.3, 0.0, 0.0)), 3e-4),
    'plate': _plate(0.5, 0.5),
    'session': _plate(1.5, 6.0),
})


class TaxelScene(KeyedScene):
    """Plays a script. rate: frames/s; seed: of the irregularities of the specimen and the noise."""

    sensor = 'taxel_array'

    def __init__(self, script: TaxelScript, rate: float, seed: int, specimen: PadSpecimen = PadSpecimen(),
                 ink: InkSpecimen = InkSpecimen()):
        super().__init__(rate, [key.time for key in script.keys],
                         [(key.x, key.y, key.turn, key.depth, key.tilt_x, key.tilt_y) for key in script.keys])
        self._script, self._seed, self._ink_specimen = script, seed, ink
        self.specimen = replace(specimen, grip=specimen.grip * script.smoothness)
        self._face = FACES[script.face]
        self._begin()

    def _begin(self) -> None:
        self.pad = RubberPad(self.specimen)
        self._ink = Ink((self.specimen.rows, self.specimen.columns), self._seed, self.rate, self._ink_specimen,
                        self._script.dead_rows)
        self._now = 0.0

    def render(self, time: float) -> tuple[np.ndarray, TruthFrame]:
        """Counts (rows, columns) and truth at a time, s; the scene repeats. An earlier time restarts it."""
        time, times = self._steps_to(time, SIMULATION.step_s)
        slipped, before = np.zeros(len(self.pad.positions), bool), self._at(self._now)
        for now in times:
            state, pose = self._step(now)
            if np.any(pose[:3] != before[:3]):  # release of an object at rest is no slip
                slipped |= state.slipping
            before = pose
        self._now = time
        return self._ink.read(self.pad.felt(state)), self._truth(state, slipped, pose, time)

    def _step(self, time: float) -> tuple[PadState, np.ndarray]:
        """The pad's state and the object's pose (6,) after its motion to a time, s."""
        pose = self._at(time)
        return self.pad.move(self._face, pose[:3], pose[3], pose[4:]), pose

    def _truth(self, state: PadState, slipped: np.ndarray, pose: np.ndarray, time: float) -> TruthFrame:
        frame = TruthFrame(wrench=self.pad.force(state))
        if not state.touched.any():
            return frame
        frame.area, frame.normal = float(state.covered.sum()) * self.pad.cell, np.array([0.0, 0.0, 1.0])
        frame.centroid = np.array([*np.average(self.pad.positions, axis=0, weights=state.covered), 0.0])
        frame.outlines, frame.holes = self._loops(state.touched)
        frame.slipping_fraction = float(slipped[state.touched].mean())
        frame.slip_state = slip_state_of(frame.slipping_fraction)
        frame.contacts = self._touches(state, pose)
        self._set_motion(frame, pose, time)
        return frame

    def _set_motion(self, frame: TruthFrame, pose: np.ndarray, time: float) -> None:
        """Set twist and motion of the object at the sensor's origin, and its centre of rotation."""
        before = self._at(max(time - 1 / self.rate, 0.0))
        rate = (pose - before)[:3] * self.rate
        at_origin = rate[:2] - rate[2] * np.array([-pose[1], pose[0]])
        frame.velocity = np.zeros(6) if frame.slip_state == NO_SLIP else np.array([*at_origin, 0, 0, 0, rate[2]])
        frame.motion = np.array([*at_origin, 0, 0, 0, rate[2]]) / self.rate
        if frame.slip_state != NO_SLIP and rate[2]:
            frame.rotation_center = np.array([-at_origin[1] / rate[2], at_origin[0] / rate[2], 0.0])

    def _touches(self, state: PadState, pose: np.ndarray) -> list[Touch]:
        image = (state.covered > 0).reshape(self.specimen.rows * PAD.fine, -1).astype(np.uint8)
        count, labels = cv2.connectedComponents(image)
        touches = []
        for label in range(1, count):
            mine = labels.ravel() == label
            middle = np.average(self.pad.positions[mine], axis=0, weights=state.covered[mine])
            force = float(state.pressure[mine].sum() * self.pad.cell)
            touches.append(Touch(np.array([*middle, -pose[3]]), np.array([0.0, 0.0, 1.0]), float(pose[3]), force))
        return touches

    def _loops(self, touched: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Outlines and holes, lists of (n, 3), m, through the positions at the border."""
        image = touched.reshape(self.specimen.rows * PAD.fine, -1).astype(np.uint8)
        lines, family = cv2.findContours(image, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
        found, middle = ([], []), 0.5 * np.array([image.shape[1] - 1, image.shape[0] - 1])
        for line, kin in zip(lines, family[0]):
            if len(line) >= 3:
                found[int(kin[3] >= 0)].append(np.pad((line[:, 0] - middle) * (self.specimen.pitch / PAD.fine), ((0, 0), (0, 1))))
        return found


def open_taxel_scene(name: str = 'demo', rate: float = 100.0, seed: int = 0) -> TaxelScene:
    """The scene of that name. Raises BadArgument for an unknown name (the message lists the known ones) or a rate that is not positive."""
    return open_keyed_scene(TAXEL_SCENES, name, rate, seed, TaxelScene)
