# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""grasp_postures: the wrench of a held object of known weight at ten postures of the wrist, by equations 6 to 9 of the array's paper and by
ours, in the frame of a force/torque sensor behind the array and at the wrist, against the engine's."""
from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation
from tf2_msgs.msg import TFMessage

from tactile_driver.errors import reports_errors
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message, static_transform
from tactile_driver.simulation.taxel.pad import Ink
from tactile_driver.sources.source import NS
from tactile_perception.api import node_parameters
from tactile_perception.common.geometry import wrench_at
from tactile_perception.common.messages import wrench_from_message
from tactile_perception.taxel.stage import TaxelStage

from ..hand.urdf import inverted
from ..sensor_files import parameter_file, simulated_calibration
from .constants import GRASP
from .objects import ARRAY_PARAMETERS, HeldObject, object_named
from .world import GraspTruth, GraspWorld

#: Rotation vectors of the wrist from upright, degrees: the array faces sideways, down, up and between.
POSTURES = ((0, 0, 0), (60, 0, 0), (-60, 0, 0), (120, 0, 0), (180, 0, 0), (0, 45, 0), (0, -45, 0), (0, 90, 0), (0, -90, 0), (70, 50, 30))
METHODS = 'paper', 'mechanics'
FRAMES = 'force_torque', 'wrist'
OBJECT, FORCE = 'heavy_box', 16.0  # N of grip: twice the minimum, since it creeps near that
_WORLD, _ARRAY = 'world', 'array'
# Pose of the force/torque sensor {S} in the frame of the array: behind it, and turned. Any other does, too.
_SENSOR = Rotation.from_rotvec([0.2, 0.0, 1.2]), np.array([0.004, -0.006, -0.038])  # m


@dataclass(frozen=True)
class PostureWrench:
    """The wrench at one posture.

    Attributes
    ----------
    true : dict
        Frame of FRAMES -> wrench (6,) of the engine, N and N m, mean over the time at the posture.
    estimated : dict
        (method of METHODS, frame) -> the same by that method.
    """

    true: dict[str, np.ndarray]
    estimated: dict[tuple[str, str], np.ndarray]


class _Array:
    """The array's stage with each method, which know the pose of the arm by /tf."""

    def __init__(self, held: HeldObject, centre: np.ndarray, seed: int):
        self._ink = Ink((GRASP.taxels, GRASP.taxels), seed, 1 / GRASP.frame_s)
        known = node_parameters('taxel_contact_node', parameter_file('taxel_array', True)) | {
            'calibration': simulated_calibration('taxel_array'), **ARRAY_PARAMETERS, 'object.weight': held.mass * GRASP.gravity,
            'object.gravity': [0.0, 0.0, -1.0], 'object.gravity_frame': _WORLD, 'object.centre_of_mass': centre.tolist(),
            'wrench_frame': FRAMES[0]}
        self._stages = {method: TaxelStage(known | {'method': method}) for method in METHODS}

    def read(self, pressure: np.ndarray, truth: GraspTruth, wrist: Rotation) -> dict[str, np.ndarray]:
        """Method -> wrench (6,) at {S}, of a frame of the engine."""
        header = header_of(NS + round(truth.time_s * NS), _ARRAY)
        pad = truth.pads[0]
        chain = ((_WORLD, FRAMES[1], wrist, np.zeros(3)), (FRAMES[1], _ARRAY, Rotation.from_matrix(pad.turn), pad.origin),
                 (_ARRAY, FRAMES[0], *_SENSOR))
        frames = TFMessage(transforms=[static_transform(parent, child, origin, turn.as_quat(), header.stamp)
                                       for parent, child, turn, origin in chain])
        image, found = image_to_message(Frame(self._ink.read(pressure), 0, 'mono8'), '', header), {}
        for method, stage in self._stages.items():
            stage.take('/tf', frames)
            found[method] = wrench_from_message(stage.process(image, ('wrench',))['wrench'][0])
        return found


def _at_wrist(wrench: np.ndarray, truth: GraspTruth) -> np.ndarray:
    """At the wrist, of a wrench (6,) at {S}."""
    pad, (turn, origin) = truth.pads[0], _SENSOR
    return wrench_at(wrench, pad.turn @ turn.as_matrix(), pad.origin + pad.turn @ origin)


def wrenches(postures: Sequence[Sequence[float]] = POSTURES, seed: int = 0) -> list[PostureWrench]:
    """The wrenches at postures, which are rotation vectors in degrees. Raises BadArgument without MuJoCo."""
    held, _ = object_named(OBJECT)
    world = GraspWorld(held)
    array = None
    found, force, wrist, begin_s = [], -1.0, Rotation.identity(), 0.0
    sums: list[dict] = []
    targets = [Rotation.from_rotvec(posture, degrees=True) for posture in postures]
    while targets:
        pressure, truth = world.advance(force)
        if array is None:
            centre = truth.pads[0].turn.T @ (truth.held.origin - truth.pads[0].origin)
            array = _Array(held, np.array([*centre[:2], held.half_width]), seed)
        estimated = array.read(pressure, truth, wrist)
        force = FORCE if truth.time_s > GRASP.untouched_s else -1.0
        if truth.is_held and not world.lifted_s >= 0 and truth.time_s > GRASP.untouched_s + GRASP.posture_settled_s:
            world.lift()
        if not world.lifted_s > GRASP.lift_s + GRASP.posture_settled_s:
            begin_s = truth.time_s
            continue
        missing = (targets[0] * wrist.inv()).as_rotvec()
        angle = float(np.linalg.norm(missing))
        if angle > 1e-6:
            wrist = Rotation.from_rotvec(missing * min(GRASP.wrist_speed * GRASP.frame_s / angle, 1.0)) * wrist
            world.turn(wrist.as_rotvec())
            begin_s = truth.time_s
        elif truth.time_s - begin_s > GRASP.posture_settled_s:
            turn, origin = inverted(_SENSOR)
            sensed = wrench_at(truth.array_wrench, turn.as_matrix(), origin)
            sums.append({FRAMES[0]: sensed, FRAMES[1]: _at_wrist(sensed, truth)} | {
                key: value for method, wrench in estimated.items()
                for key, value in (((method, FRAMES[0]), wrench), ((method, FRAMES[1]), _at_wrist(wrench, truth)))})
            if truth.time_s - begin_s > GRASP.posture_settled_s + GRASP.posture_measured_s:
                means = {key: np.mean([one[key] for one in sums], axis=0) for key in sums[0]}
                found.append(PostureWrench({frame: means[frame] for frame in FRAMES},
                                           {key: means[key] for key in means if isinstance(key, tuple)}))
                sums = []
                targets.pop(0)
    return found


def print_table(postures: Sequence[Sequence[float]] = POSTURES) -> None:
    """Print the true wrench at each posture, and the errors of each method, as Markdown."""
    print('| wrist turned by, deg | frame | true force N | true moment mN m '
          + ''.join(f'| {method}: force error N | moment error mN m ' for method in METHODS) + '|')
    print('|---' * (4 + 2 * len(METHODS)) + '|')
    found = wrenches(postures)
    rows = [(frame, [float(np.linalg.norm((one.estimated[method, frame] - one.true[frame])[part])) * scale
                     for method in METHODS for part, scale in ((slice(0, 3), 1.0), (slice(3, 6), 1e3))])
            for one in found for frame in FRAMES]
    for number, (frame, errors) in enumerate(rows):
        posture, true = postures[number // len(FRAMES)], found[number // len(FRAMES)].true[frame]
        texts = [' '.join(f'{value:.2f}' for value in true[:3]), ' '.join(f'{1e3 * value:.0f}' for value in true[3:])]
        print(f'| {" ".join(map(str, posture))} | {frame} | {" | ".join(texts + [f"{error:.3g}" for error in errors])} |')
    for frame in FRAMES:
        means = np.mean([errors for name, errors in rows if name == frame], axis=0)
        print(f'| mean | {frame} | | | {" | ".join(f"{mean:.3g}" for mean in means)} |', flush=True)


@reports_errors('grasp_postures', OSError)
def main(args: list[str] | None = None) -> int:
    """Print the table; exit code 1 without MuJoCo."""
    parser = argparse.ArgumentParser(prog='grasp_postures', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.parse_args(args)
    print_table()
    return 0
