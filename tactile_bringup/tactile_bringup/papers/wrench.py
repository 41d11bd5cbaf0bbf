# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The case study of the paper taxel_array_image_processing, section IV: the wrench at the force/torque sensor, eqs 5 to 9."""
from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

from tactile_driver.nodes.messages.conversions import quaternion_of, static_transform
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode, encode
from tactile_driver.recordings.writer import BagWriter
from tactile_driver.simulation.taxel.held import HeldScene, open_held_scene

from ..simulate.bags import write_taxel_scene
from .bench import Bench, Detail, Method, Row, Table, common, mean, reported, shipped
from .constants import PAPERS
from .figures import OURS, PUBLISHED, TRUTH, Curves, Picture, draw_curves

SCENES = ('postures', 'at several postures of the arm'), ('pushed', 'while it is pushed and tilts')
_SENSOR, _ARRAY, _WORLD, _JOINT = 'force_torque', 'taxel_array', 'world', 'finger'
# The pose of the force/torque sensor {S} in the frame of the array: behind it, and turned. Any other does, too.
_ORIGIN, _TURN = np.array([0.004, -0.006, -0.038]), np.array([0.2, 0.0, 1.2])  # m; rotation vector, rad
_COMPONENTS = ('force x', 'N'), ('force y', 'N'), ('force z', 'N'), ('moment x', 'mN m'), ('moment y', 'mN m'), ('moment z', 'mN m')
AREA, TORQUE = 'nonzero area', 'moment about the contact'
_CAUSES = AREA, AREA, AREA, AREA, AREA, TORQUE


def wrenches(bench: Bench) -> Iterator[Table]:
    """Fig 8: a bar of known weight that two fingers hold, its wrench at the force/torque sensor {S}."""
    for name, what in SCENES:
        scene = open_held_scene(name, PAPERS.taxel_rate, bench.seed)
        rows: tuple[list, ...] = [], []
        truth = []
        for stamp, true, estimates in bench.compare(_held(bench, name, scene), *_methods(bench, scene)):
            if true.contacts and true.wrench is not None and scene.arm(_time(stamp)).lift == 1:
                truth.append((stamp, *_at_sensor(true.wrench)))
                for found, estimate in zip(rows, estimates):
                    found.append(_scaled(np.full(6, np.nan) if estimate.wrench is None else estimate.wrench))
        yield _table(name, what, np.array(truth).reshape(-1, 7), [np.array(found).reshape(-1, 6) for found in rows])


def _table(name: str, what: str, truth: np.ndarray, methods: list[np.ndarray]) -> Table:
    """truth: (N, 7) stamp, s, and components; methods: (N, 6) of each, N and mN m."""
    errors = common(*(np.abs(found - truth[:, 1:]) for found in methods))
    rows = [Row(f'{component}, mean error', unit, '', *(mean(some[:, k]) for some in errors), cause=_CAUSES[k])
            for k, (component, unit) in enumerate(_COMPONENTS)]
    size = [float(np.linalg.norm(truth[:, part], axis=1).max()) if len(truth) else np.nan for part in (slice(1, 4), slice(4, 7))]
    rows += [Row('true force, maximum', 'N', '', size[0], size[0]), Row('true moment, maximum', 'mN m', '', size[1], size[1]),
             Row('frames reported', '%', '', *(reported(found) for found in methods))]
    curves = tuple(Curves(f'{component}, {unit}', 'time, s', {TRUTH: (truth[:, 0], truth[:, k + 1])} | {
        method: (truth[:, 0], found[:, k]) for method, found in zip((PUBLISHED, OURS), methods)}) for k, (component, unit) in
        enumerate(_COMPONENTS))
    return Table('The wrench of a bar: fig 8', rows,
                 'The bar weighs 3 N, its centre of mass lies 6 mm from the middle of the face. The wrench is that at the force/torque '
                 'sensor {S}, 38 mm behind the pad, and turned. Its method takes the depth from the opening of the gripper. Ours takes the '
                 'force from calibrated pressure, and knows the centre of mass, for which eqs 6 to 9 have no use. The paper shows a plot.',
                 (Picture(f'fig_8_{name}', f'The wrench of a bar {what}: fig 8', partial(draw_curves, curves), (11.0, 6.5)),), name)


def _methods(bench: Bench, scene: HeldScene) -> list[Method]:
    known = {'object.weight': scene.script.weight, 'object.gravity': [0.0, 0.0, -1.0], 'object.gravity_frame': _WORLD,
             'wrench_frame': _SENSOR}
    middle = [float(coordinate) for coordinate in (*scene.centre_of_mass, 0.5 * PAPERS.bar_width)]
    changes = ({'method': 'paper', 'gripper.joint': _JOINT, 'object.width': PAPERS.bar_width},
               {'method': 'mechanics', 'object.centre_of_mass': middle})
    return [(bench.params('taxel_array', change | known), shipped('taxel_array')) for change in changes]


def _held(bench: Bench, name: str, scene: HeldScene) -> Path:
    """The bag of a scene, with the pose of the arm on /tf and the position of the gripper on /joint_states before each image."""
    alone = bench.written(name, lambda bag: write_taxel_scene(bag, name, PAPERS.taxel_rate, bench.seed, scene=scene))

    def write(bag: Path) -> None:
        """Write the bag: the messages of the array alone, and those of the arm."""
        with BagReader(alone) as reader, BagWriter(bag) as writer:
            for raw in reader.messages():
                if raw.topic.endswith('image_raw'):
                    header, arm = decode(raw.data, raw.type_name).header, scene.arm(_time(1e-9 * raw.stamp_ns))
                    moved = TFMessage(transforms=[
                        static_transform(_WORLD, _ARRAY, np.zeros(3), quaternion_of(_upright(scene.gravity(arm))), header.stamp),
                        static_transform(_ARRAY, _SENSOR, _ORIGIN, quaternion_of(_TURN), header.stamp)])
                    joint = JointState(header=header, name=[_JOINT], position=[PAPERS.bar_width - 2 * arm.depth])
                    for topic, message in (('/tf', moved), ('/joint_states', joint)):
                        kind, data = encode(message)
                        writer.write(topic, kind, raw.stamp_ns - 1, data)
                writer.write(*raw[:4])
    return bench.written(f'{name}_arm', write)


def _time(stamp: float) -> float:
    """Time in the scene, s, of a stamp, s: that of the first frame is 1 s."""
    return stamp - 1.0


def _upright(gravity: np.ndarray) -> np.ndarray:
    """Rotation vector (3,), rad, that turns gravity (3,) in the array's frame downwards: the array's pose in the world."""
    down = np.array([0.0, 0.0, -1.0])
    axis, cosine = np.cross(gravity, down), float(gravity @ down)
    sine = float(np.linalg.norm(axis))
    return axis * (np.arctan2(sine, cosine) / sine) if sine > 0 else np.array([0.0 if cosine > 0 else np.pi, 0.0, 0.0])


def _at_sensor(wrench: np.ndarray) -> np.ndarray:
    """What the force/torque sensor measures, (6,) N and mN m, of a wrench (6,) at the origin of the array."""
    angle = float(np.linalg.norm(_TURN))
    x, y, z = _TURN / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    force, moment = wrench[:3], wrench[3:]
    return _scaled(np.concatenate([turn.T @ force, turn.T @ (moment - np.cross(_ORIGIN, force))]))


def _scaled(wrench: np.ndarray) -> np.ndarray:
    """N and mN m."""
    return wrench * [1, 1, 1, 1e3, 1e3, 1e3]


def details(bench: Bench) -> Iterator[Detail]:
    """Eq 5 with the true area, depth and stiffness, and the wrench with true forces and moments: one after the other, of the same bags."""
    yield from areas(bench)
    yield from moments(bench)


def moments(bench: Bench) -> Iterator[Detail]:
    """The wrench with the true normal force, and with the true moments about the middle of the contact."""
    found = []
    for name, _ in SCENES:
        scene, errors = open_held_scene(name, PAPERS.taxel_rate, bench.seed), []
        for stamp, true, (papers, _) in bench.compare(_held(bench, name, scene), *_methods(bench, scene)):
            if not (true.contacts and true.wrench is not None and papers.contacts and scene.arm(_time(stamp)).lift == 1):
                continue
            middle, stated = papers.region.centroid, sum(contact.force for contact in papers.contacts)
            pressed = np.array([0.0, 0.0, stated + true.wrench[2]])
            known = _scaled(papers.wrench) + _at_sensor(np.concatenate([pressed, np.cross(middle, pressed)]))
            about = true.wrench[3:] - np.cross(middle, true.wrench[:3])
            truth = _at_sensor(true.wrench)
            errors.append([np.abs(part - truth) for part in (
                _scaled(papers.wrench), known, known + _at_sensor(np.array([0.0, 0.0, 0.0, *about])))])
        for what, means in zip(('eqs 5 to 9', 'with the true normal force', 'and the true moment about the middle of the contact'),
                               np.mean(np.array(errors).reshape(-1, 3, 6), axis=0)):
            found.append((f'{name}, {what}', *means.tolist()))
    yield Detail(TORQUE, ('scene', *(f'{component}, {unit}' for component, unit in _COMPONENTS)), found,
                 'Mean errors at the force/torque sensor. Eq 9 has no moment about the middle of the contact: neither that of friction, '
                 'which holds the weight off its centre, nor that of pressure, on which a pushed bar leans.')


def areas(bench: Bench) -> Iterator[Detail]:
    """Eq 5 with the true area, depth and stiffness, one after the other."""
    found = []
    for name, _ in SCENES:
        scene, forces = open_held_scene(name, PAPERS.taxel_rate, bench.seed), []
        for stamp, true, (papers, _) in bench.compare(_held(bench, name, scene), *_methods(bench, scene)):
            arm = scene.arm(_time(stamp))
            if true.contacts and true.region is not None and papers.contacts and arm.lift == 1:
                touch, stated = true.contacts[0], sum(contact.force for contact in papers.contacts)
                per_area, real = stated / papers.region.area, true.region.area
                stiffness = scene.specimen.press * arm.depth
                forces.append((stated - touch.force, per_area * real - touch.force, stiffness * real - touch.force,
                               scene.specimen.press * touch.depth * real - touch.force, 1e6 * papers.region.area, 1e6 * real))
        table = np.array(forces).reshape(-1, 6)
        found.append((f'{name}', *(mean(np.abs(table[:, k])) for k in range(4)), *(mean(table[:, k]) for k in (4, 5))))
    yield Detail(AREA, ('scene', 'eq 5, error, N', 'with the true area, N', 'and the true stiffness, N', "and this pad's true depth, N",
                        'area of the nonzero taxels, mm^2', 'true area, mm^2'), found,
                 'Mean errors of the normal force. The sheet spreads the load, so that more taxels are nonzero than the face covers. The '
                 'opening of the gripper gives the mean of both depths; where a finger carries the bar from below, its pad is deeper.')
