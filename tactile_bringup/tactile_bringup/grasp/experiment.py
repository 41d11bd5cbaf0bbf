# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""grasp_table: what falls, breaks and moves in the simulated gripper, with the controller, with a fixed force and with known friction.

Frames, estimates and commands follow each other without ROS and without waiting, so that a run has the same result on every machine.
"""
from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tactile_driver.errors import reports_errors
from tactile_driver.simulation.taxel.pad import Ink
from tactile_perception.api import node_parameters
from tactile_perception.taxel.parameters import taxel_estimator

from ..sensor_files import parameter_file, simulated_calibration
from .controller import GripController, GripLimits, Phase, Reading, slip_probability
from .objects import HELD_S, OBJECTS, SETTLED_S, object_named
from .world import FRAME_S, TAXELS, GraspTruth, GraspWorld

POLICIES = ('controller', 'fixed', 'oracle')
FIXED_FORCE = 6.0  # N, of a gripper that knows nothing of its object
ORACLE_MARGIN = 1.3  # over the least force, of a gripper that knows weight and friction
SLIP_SPEED = 2e-3  # m/s, from which the engine's object slips: a hundred times its creep
_UNTOUCHED_S, _MAX_DURATION_S = 0.3, 20.0  # before the gripper closes; of a grasp that is never lifted
FALLEN = 0.015  # m; an object that has moved so far in the hand is dropped


@dataclass(frozen=True)
class Grasp:
    """One grasp of an object.

    Attributes
    ----------
    is_dropped, is_crushed : bool
    displacement : float
        Largest of the object in the hand after the lift began, m; of a dropped one infinite.
    force_ratio : float
        Median of the grip force over the least force that holds, while it is held.
    delay : float
        Median time from slip in the engine to a higher command, s; NaN where nothing slipped.
    recall, false_share : float
        Part of the frames with slip, and part of those without, of which the sensor reports slip; NaN where there is none.
    """

    is_dropped: bool
    is_crushed: bool
    displacement: float
    force_ratio: float
    delay: float
    recall: float
    false_share: float


class Trace:
    """Collects what happens in a grasp."""

    def __init__(self, crushing_force: float) -> None:
        self._rows: list[tuple[float, ...]] = []
        self._crushing_force = crushing_force

    def add(self, lifted_s: float, truth: GraspTruth, command: float, reported_slip: float) -> None:
        """One frame; lifted_s: since the lift began; reported_slip: probability of slip by the sensor."""
        self._rows.append((truth.grip_force, command, float(np.linalg.norm(truth.displacement)), float(np.linalg.norm(truth.velocity)),
                           truth.least_force, reported_slip, float(lifted_s > 0), float(lifted_s > 0 and truth.is_held)))

    def result(self) -> Grasp:
        """The measures of the grasp."""
        force, command, moved, speed, least, slip, lifted, held = np.array(self._rows).T
        lifted = lifted > 0
        if not lifted.any():  # never held
            return Grasp(True, bool(force.max() > self._crushing_force), np.inf, *[np.nan] * 4)
        is_dropped = bool((np.nan_to_num(moved[lifted]) > FALLEN).any() or not held[-1])
        slipping, still = (held > 0) & (speed > SLIP_SPEED), (held > 0) & (speed < 0.25 * SLIP_SPEED)
        called = slip > GripLimits.slip_probability
        return Grasp(is_dropped, bool(force.max() > self._crushing_force), float('inf') if is_dropped else float(moved[lifted].max()),
                     float(np.median((force / least)[held > 0])) if held.any() else np.nan, _delay(slipping, command),
                     _share(called, slipping), _share(called, still))


def _share(called: np.ndarray, frames: np.ndarray) -> float:
    return float(called[frames].mean()) if frames.any() else np.nan


def _delay(slipping: np.ndarray, command: np.ndarray) -> float:
    """Median time, s, from the beginnings of slip to the next rise of the command."""
    begins = np.flatnonzero(slipping[1:] & ~slipping[:-1]) + 1
    rises = np.flatnonzero(np.diff(command) > 0.01) + 1
    delays = [rises[rises >= begin][0] - begin for begin in begins if (rises >= begin).any()]
    return FRAME_S * float(np.median(delays)) if delays else np.nan


def grasp(name: str, policy: str, seed: int = 0) -> Grasp:
    """Grasp, lift and hold an object.

    Parameters
    ----------
    name : str
        One of OBJECTS.
    policy : str
        One of POLICIES: the controller; FIXED_FORCE; ORACLE_MARGIN times the least force at every moment.
    seed : int
        Of the noise and irregularities of the array.

    Raises
    ------
    BadArgument
        For an unknown object, or without MuJoCo.
    """
    held, disturbances = object_named(name)
    world, controller, trace = GraspWorld(held, disturbances), GripController(), Trace(held.crushing_force)
    array, estimator = Ink((TAXELS, TAXELS), seed, 1 / FRAME_S), _estimator()
    command, held_s = -1.0, np.inf
    while world.lifted_s < HELD_S and world.time_s < _MAX_DURATION_S:
        pressure, truth = world.advance(command)
        result = estimator.process(array.read(pressure), truth.time_s)
        slip = slip_probability(result.slip.state, result.slip.confidence)
        trace.add(world.lifted_s, truth, command, slip)
        if truth.time_s > _UNTOUCHED_S:
            controller.close()
        own = controller.take(Reading(truth.time_s, sum(contact.force for contact in result.contacts), slip))
        if controller.phase is Phase.HOLD:
            held_s = min(held_s, truth.time_s)
        if truth.time_s - held_s > SETTLED_S and not world.lifted_s >= 0:
            world.lift()
        command = -1.0 if controller.phase is Phase.OPEN else _command(policy, own, truth)
    return trace.result()


def _command(policy: str, own: float, truth: GraspTruth) -> float:
    if policy == 'controller' or own <= GripLimits.approach_force:  # all approach alike
        return own
    return FIXED_FORCE if policy == 'fixed' else max(ORACLE_MARGIN * truth.least_force, GripLimits.min_force)


def _estimator():
    calibration = simulated_calibration('taxel_array')
    return taxel_estimator(node_parameters('taxel_contact_node', parameter_file('taxel_array', True)) | {'calibration': calibration})


def print_table(names: Sequence[str], seeds: Sequence[int]) -> None:
    """Print the table of all grasps, as Markdown, row by row."""
    print('| object | policy | dropped | crushed | displacement mm | force / least | delay ms | slip recall | false slip |')
    print('|---|---|---|---|---|---|---|---|---|', flush=True)
    for name in names:
        for policy in POLICIES:
            found = [grasp(name, policy, seed) for seed in (seeds if policy == 'controller' else seeds[:1])]
            values = [np.median([getattr(each, field) for each in found]) for field in (
                'displacement', 'force_ratio', 'delay', 'recall', 'false_share')]
            scaled = [1e3 * values[0], values[1], 1e3 * values[2], values[3], values[4]]
            counts = [f'{sum(getattr(each, field) for each in found)} of {len(found)}' for field in ('is_dropped', 'is_crushed')]
            shown = ['-' if np.isnan(value) else f'{value:.3g}' for value in scaled]
            print(f'| {name} | {policy} | {" | ".join(counts + shown)} |', flush=True)


@reports_errors('grasp_table', OSError)
def main(args: list[str] | None = None) -> int:
    """Print the table; exit code 1 for an unknown object, or without MuJoCo."""
    parser = argparse.ArgumentParser(prog='grasp_table', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--objects', nargs='+', default=list(OBJECTS), help=f'of {", ".join(OBJECTS)}')
    parser.add_argument('--seeds', type=int, nargs='+', default=[0], help='of the noise of the array')
    given = parser.parse_args(args)
    for name in given.objects:
        object_named(name)
    print_table(given.objects, given.seeds)
    return 0
