# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes of simulated force taxels with ground truth: objects that are pressed on, held, dragged and turned."""
from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...plugins import PluginTable
from ..keyed_scene import KeyedScene, open_keyed_scene
from ..truth import NO_SLIP, NON_CONTACT, SLIPPING, STICKING, Touch, TruthFrame, slip_state_of
from .device import DEVICES, Electronics, Specimen, SpringBed


@dataclass(frozen=True)
class Motion:
    """Steps and limits of the object's motion."""

    step_s: float = 0.002  # s of the object's motion
    slips: float = 1e-4  # m/s, slower motion of a node over the object is creep
    felt: float = 0.02  # N, on a taxel that is touched
    clear: float = -5e-4  # m, depth of an object that does not touch


MOTION = Motion()


def _plate(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    return z + 0.01 * x


def _ball(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    return 0.012 - np.sqrt(x**2 + y**2 + (z - 0.012)**2)


def _rod(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    return 0.008 - np.hypot(x, z - 0.008)


def _punch(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    return z - np.maximum(np.hypot(x, y) - 0.005, 0.0)**2 / 0.002


#: Name of an object -> depth (K,) m in it of points relative to its lowest point.
OBJECTS: Mapping[str, Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]] = {
    'plate': _plate, 'ball': _ball, 'rod': _rod, 'punch': _punch}


@dataclass(frozen=True)
class Key:
    """Pose of the object at a time, s: x, y (m), turn (rad), depth (m) of its lowest point under the highest of the device; load: (3,) N, a
    force that is spread evenly over all nodes besides, of a weight on a plate that is glued on."""

    time: float
    x: float = 0.0
    y: float = 0.0
    turn: float = 0.0
    depth: float = MOTION.clear
    load: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class VectorScript:
    """device: name in DEVICES; thing: name in OBJECTS; keys: in order of time, linearly interpolated; friction: coefficient."""

    device: str
    thing: str
    keys: tuple[Key, ...]
    friction: float = 0.6


def _demo(device: str, thing: str = 'ball', depth: float = 6e-4) -> VectorScript:
    """Pressed, held, sheared without slip, dragged, held, dragged back, turned, released."""
    poses = ((0.0, 0, 0, 0, MOTION.clear), (1.5, 0, 0, 0, MOTION.clear), (2.0, 0, 0, 0, depth), (2.6, 0, 0, 0, depth),
             (3.0, 1e-4, 0, 0, depth), (3.6, 1e-4, 0, 0, depth), (4.6, 4e-3, 1e-3, 0, depth), (5.2, 4e-3, 1e-3, 0, depth),
             (6.4, -1e-3, -1e-3, 0, depth),
             (6.8, -1e-3, -1e-3, 0, depth), (7.6, -1e-3, -1e-3, 0.8, depth), (8.0, -1e-3, -1e-3, 0.8, depth),
             (8.4, -1e-3, -1e-3, 0.8, MOTION.clear), (9.2, 0, 0, 0, MOTION.clear))
    return VectorScript(device, thing, tuple(Key(*pose) for pose in poses))


def random_script(device: str, seed: int) -> VectorScript:
    """Two touches of a random object at random positions: each pressed, held, sheared below the limit of friction, dragged there and back,
    and released."""
    rng, keys = np.random.default_rng(seed), [Key(0.0), Key(1.5)]
    half = 0.004 if device == 'fingertip' else 0.005
    thing = str(rng.choice([*OBJECTS]))

    def go(seconds: float, **change) -> None:
        keys.append(replace(keys[-1], time=keys[-1].time + seconds, **change))
    friction = rng.uniform(0.3, 1.0)
    _, it = DEVICES[device]
    for _ in range(2):
        (x, y), depth = rng.uniform(-half, half, 2), rng.uniform(3e-4, 7e-4)
        keys.append(Key(keys[-1].time + 0.01, x, y, rng.uniform(-1, 1)))
        go(rng.uniform(0.3, 0.8), depth=depth)
        go(rng.uniform(0.3, 0.8))
        angle = rng.uniform(-np.pi, np.pi)
        held = 0.3 * friction * depth * it.press / it.pull
        go(rng.uniform(0.2, 0.5), x=x + held * np.cos(angle), y=y + held * np.sin(angle))
        go(rng.uniform(0.3, 0.8))
        for _ in range(2):
            path, last = rng.uniform(2e-3, 5e-3), keys[-1]
            go(path / rng.uniform(3e-3, 1.5e-2), x=last.x + path * np.cos(angle), y=last.y + path * np.sin(angle),
               turn=last.turn + rng.uniform(-0.2, 0.2))
            go(rng.uniform(0.2, 0.6))
            angle += np.pi + rng.uniform(-0.5, 0.5)
        go(rng.uniform(0.2, 0.5), depth=MOTION.clear)
        go(rng.uniform(0.5, 1.0))
    return VectorScript(device, thing, tuple(keys), friction)


def _weights(device: str) -> VectorScript:
    """Untouched for a second, then a weight of 5 N that presses, then the same that pulls along x, then along y, untouched in between; and
    the same with half of it."""
    keys, loads = [Key(0.0), Key(1.2)], ((0, 0, -5.0), (5.0, 0, 0), (0, 5.0, 0))
    for load in (*loads, *(tuple(0.5 * part for part in load) for load in loads)):
        for seconds, now in ((0.2, load), (1.5, load), (0.2, (0.0, 0.0, 0.0)), (1.0, (0.0, 0.0, 0.0))):
            keys.append(Key(keys[-1].time + seconds, load=tuple(map(float, now))))
    return VectorScript(device, 'plate', tuple(keys))


def _scenes() -> dict[str, VectorScript | Callable[[float, int], VectorScene]]:
    found: dict = {}
    for device in DEVICES:
        found[f'{device}_demo'] = _demo(device, 'rod' if device == 'uskin' else 'plate')
        found[f'{device}_rest'] = VectorScript(device, 'ball', (Key(0.0), Key(20.0)))
        found[f'{device}_weights'] = _weights(device)
        found[f'{device}_random'] = lambda rate, seed, device=device: VectorScene(random_script(device, seed), rate, seed)
    return found | {'demo': found['uskin_demo']}


class VectorScene(KeyedScene):
    """Plays a script. rate: frames/s; seed: of the irregularities of the specimen and the noise; specimen: instead of the device's own."""

    sensor = 'force_taxels'

    def __init__(self, script: VectorScript, rate: float, seed: int, specimen: Specimen | None = None):
        super().__init__(rate, [key.time for key in script.keys],
                         [(key.x, key.y, key.turn, key.depth, *key.load) for key in script.keys])
        self._script, self._seed = script, seed
        self.shape, own = DEVICES[script.device]
        self.specimen = specimen or own
        self._begin()

    def _begin(self) -> None:
        # Gains and dead taxels are the specimen's; noise and texture are new in each scene.
        self.electronics = Electronics(self.shape, self.specimen, np.random.default_rng(self._seed))
        self.bed = SpringBed(self.shape, self.specimen, self._script.friction, np.random.default_rng([self._seed, 1]))
        self._now = 0.0

    def render(self, time: float) -> tuple[np.ndarray, TruthFrame]:
        """Numbers (N, 3) and truth at a time, s; the scene repeats. An earlier time restarts it."""
        time, times = self._steps_to(time, MOTION.step_s)
        slid, before = np.zeros(len(self.shape.nodes)), self._at(self._now)
        for now in times:
            pose = self._at(now)
            self.bed.move(self._depths(pose), self._motion(before, pose))
            slid += self.bed.slid
            before = pose
        interval, self._now = max(time - self._now, 1e-6), time
        forces = self.bed.forces + pose[4:] / len(self.shape.nodes)
        return self.electronics.read(forces, interval), self._truth(forces, slid > MOTION.slips * interval, pose, time)

    def _depths(self, pose: np.ndarray) -> np.ndarray:
        """Depth (K,), m, of each node in the object."""
        away = self.shape.nodes - [pose[0], pose[1], self.shape.top - pose[3]]
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        return OBJECTS[self._script.thing](cos * away[:, 0] + sin * away[:, 1], cos * away[:, 1] - sin * away[:, 0], away[:, 2])

    def _motion(self, before: np.ndarray, pose: np.ndarray) -> np.ndarray:
        """Motion (K, 3), m, of the object at each node between two poses."""
        turn, away = pose[2] - before[2], self.shape.nodes[:, :2] - before[:2]
        across = pose[:2] - before[:2] + turn * np.column_stack([-away[:, 1], away[:, 0]])
        return np.column_stack([across, np.full(len(across), before[3] - pose[3])])

    def _truth(self, forces: np.ndarray, slipping: np.ndarray, pose: np.ndarray, time: float) -> TruthFrame:
        frame = TruthFrame(wrench=np.concatenate([forces.sum(axis=0), np.cross(self.shape.nodes, forces).sum(axis=0)]))
        pressed, shape = self.bed.pressed, self.shape
        count = len(shape.positions)
        load = np.bincount(shape.owner, pressed, count)
        slips = np.bincount(shape.owner, pressed * slipping, count) > 0.5 * load
        frame.dot_id = np.arange(count)
        frame.dot_state = np.where(load > MOTION.felt, np.where(slips, SLIPPING, STICKING), NON_CONTACT).astype(np.uint8)
        touched = pressed > 0
        if load.max() <= MOTION.felt:
            return frame
        frame.area, frame.centroid = float(touched.sum()) * shape.cell, np.average(shape.nodes, axis=0, weights=pressed)
        normal = np.average(shape.facing, axis=0, weights=pressed)
        frame.normal = normal / np.linalg.norm(normal)
        frame.slipping_fraction = float(pressed @ slipping / pressed.sum())
        frame.slip_state = slip_state_of(frame.slipping_fraction)
        frame.contacts = [Touch(frame.centroid, frame.normal, float(pose[3]), float(-forces.sum(axis=0) @ frame.normal))]
        rate = (pose - self._at(max(time - 1 / self.rate, 0.0)))[:3] * self.rate
        linear = rate[:2] - rate[2] * np.array([-pose[1], pose[0]])
        frame.motion = np.array([*linear, 0, 0, 0, rate[2]]) / self.rate
        frame.velocity = np.zeros(6) if frame.slip_state == NO_SLIP else frame.motion * self.rate
        return frame


#: Name -> script, or function of rate and seed that makes the scene.
VECTOR_SCENES: Mapping[str, VectorScript | Callable[[float, int], VectorScene]] = PluginTable('tactile_driver.vector_scenes', _scenes())


def open_vector_scene(name: str = 'demo', rate: float = 100.0, seed: int = 0) -> VectorScene:
    """The scene of that name. Raises BadArgument for an unknown name (the message lists the known ones) or a rate that is not positive."""
    return open_keyed_scene(VECTOR_SCENES, name, rate, seed, VectorScene)
