# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""grasp_poses: the pose of the held object from its sensors, against the engine's.

The engine's pads are rigid, so that the object does not follow the touchpad's skin where that yields: this yielding, which the simulation
knows, is taken off what the touchpad reports.
"""
from __future__ import annotations

import argparse
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation
from std_msgs.msg import Header

from tactile_driver.errors import reports_errors
from tactile_driver.simulation.skin.tools import Pose as ToolPose
from tactile_perception.common.messages import results_to_messages

from ..hand.held_pose import HeldPoseTracker, Report
from ..hand.urdf import Pose, chained, inverted
from ..nodes.hand_object import report_of
from .experiment import Sensors, grasp
from .objects import OBJECTS, object_named
from .skin import APEX
from .world import GraspTruth, GraspWorld

_TOPICS = 'contacts', 'contact_region'
USED = ('array', 'touchpad'), ('touchpad',), ('array',)


@dataclass(frozen=True)
class PoseErrors:
    """Of one grasp.

    Attributes
    ----------
    displacement : float
        Largest true one, m.
    position, largest : float
        Root mean square and largest error, m.
    tilt, turn : float
        Root mean square of the error of the rotation about axes along the pads and about their normal, rad.
    position_nees, rotation_nees : float
        Mean of the error squared over its covariance, per degree of freedom: 1 for an honest covariance.
    """

    displacement: float
    position: float
    largest: float
    tilt: float
    turn: float
    position_nees: float
    rotation_nees: float


class PoseWatch:
    """Follows the object in the reports of the sensors named in `used`, beside the engine."""

    def __init__(self, used: Collection[str]):
        self._used, self._tracker = tuple(used), HeldPoseTracker(len(used))
        self._start: tuple[ToolPose, np.ndarray] | None = None  # the engine's pose when the object was gripped, and the origin, m
        self._skin: tuple[Pose, Pose] | None = None  # of the object: on the skin, and in the rigid pad's frame, at the last image
        self._rows: list[tuple[np.ndarray, np.ndarray, float]] = []  # error, covariance, true displacement

    def __call__(self, _world: GraspWorld, truth: GraspTruth, sensors: Sensors, reported: Collection[str]) -> None:
        """One frame."""
        if 'array' in reported and 'array' in self._used:
            found = results_to_messages(sensors.array.result, Header(), _TOPICS)
            report = report_of(found['contacts'][0], found['contact_region'][0], _pose(truth.pads[0]), 'taxel_array')
            self._tracker.take('array', replace(report, time_s=truth.time_s))
        if 'touchpad' in reported and 'touchpad' in self._used:
            self._tracker.take('touchpad', self._without_yielding(truth, sensors))
        if set(reported) & set(self._used):
            self._compare(truth)

    def _without_yielding(self, truth: GraspTruth, sensors: Sensors) -> Report:
        finger, found = sensors.touchpad.finger, sensors.touchpad.found
        below = Rotation.identity(), np.array([0.0, 0.0, -APEX])
        report = replace(report_of(found['contacts'][0], found['contact_region'][0], chained(_pose(truth.pads[1]), below), 'touchpad'),
                         time_s=truth.time_s)
        before, self._skin = self._skin, None
        if finger.object_pose is not None:
            self._skin = _pose(finger.object_pose), chained(inverted(below), _pose(truth.object_pose))
        if report.motion is None or before is None or self._skin is None:
            return replace(report, motion=None)
        (seen, real), (seen_before, real_before) = self._skin, before
        yielded = chained(chained(real, inverted(real_before)), chained(seen_before, inverted(seen)))
        return replace(report, motion=chained(yielded, report.motion))

    def _compare(self, truth: GraspTruth) -> None:
        found = self._tracker.pose()
        if found is None:
            self._start = None
            return
        if self._start is None:
            self._start = truth.held, found.position
        first, origin = self._start
        turn = truth.held.turn @ first.turn.T
        real = turn @ (origin - first.origin) + truth.held.origin
        error = np.concatenate([found.position - real, (found.rotation * Rotation.from_matrix(turn).inv()).as_rotvec()])
        self._rows.append((error, found.covariance, float(np.linalg.norm(real - origin))))

    def errors(self) -> PoseErrors:
        """Of the whole grasp; NaN where nothing was held."""
        if not self._rows:
            return PoseErrors(*[np.nan] * 7)
        error, covariance = (np.array([row[k] for row in self._rows]) for k in (0, 1))
        ratios = [np.mean([e[part] @ np.linalg.solve(c[part, part], e[part]) for e, c in zip(error, covariance)]) / 3
                for part in (slice(0, 3), slice(3, 6))]
        size = np.linalg.norm(error[:, :3], axis=1)
        return PoseErrors(max(row[2] for row in self._rows), _rms(size), float(size.max()), _rms(np.linalg.norm(error[:, 4:], axis=1)),
                          _rms(error[:, 3]), *ratios)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _pose(pose: ToolPose) -> Pose:
    return Rotation.from_matrix(pose.turn), pose.origin


def pose_errors(name: str, seed: int = 0) -> list[PoseErrors]:
    """The errors of one grasp with the sensors of each of USED. Raises BadArgument for an unknown object, or without MuJoCo."""
    watches = [PoseWatch(used) for used in USED]

    def watch(*seen) -> None:
        for one in watches:
            one(*seen)
    grasp(name, 'controller', seed, watch=watch, topics=_TOPICS)
    return [one.errors() for one in watches]


def print_table(names: Sequence[str]) -> None:
    """Print the errors of all objects, as Markdown, row by row."""
    print('| object | sensors | displacement mm | position error mm | largest mm | tilt error deg | turn error deg '
          '| position: error^2 / covariance | rotation |')
    print('|---' * 9 + '|', flush=True)
    for name in names:
        for used, found in zip(USED, pose_errors(name)):
            values = [*(1e3 * np.array([found.displacement, found.position, found.largest])), *np.degrees([found.tilt, found.turn]),
                      found.position_nees, found.rotation_nees]
            print(f'| {name} | {" and ".join(used)} | {" | ".join(f"{value:.2g}" for value in values)} |', flush=True)


@reports_errors('grasp_poses', OSError)
def main(args: list[str] | None = None) -> int:
    """Print the table; exit code 1 for an unknown object, or without MuJoCo."""
    parser = argparse.ArgumentParser(prog='grasp_poses', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--objects', nargs='+', default=list(OBJECTS), help=f'objects to grasp, of {", ".join(OBJECTS)}; default: all')
    given = parser.parse_args(args)
    for name in given.objects:
        object_named(name)
    print_table(given.objects)
    return 0
