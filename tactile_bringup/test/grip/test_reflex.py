# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the reflex commands, case by case; and that it holds what would be lost, with the estimator between it and the object."""
from pathlib import Path

import numpy as np
import pytest
from tactile_bringup.nodes.grip_reflex import LONGEST_S, Reflex
from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.taxel.scene import HeldScene
from tactile_driver.simulation.truth import INCIPIENT, NO_SLIP
from tactile_perception.taxel.parameters import TAXEL_PARAMETERS, taxel_estimator

REFLEX = Reflex(hold=1.0, most=4.0, closing=20.0)
CALIBRATION = Path(__file__).resolve().parents[2] / 'calibration' / 'taxel_array_sim.yaml'
RATE, GRIPPER = 100.0, 50.0  # Hz; N/s


def test_it_holds_at_the_first_touch_and_while_nothing_slips():
    assert REFLEX.next_force(0.0, True, False, 0.01) == 1.0
    assert REFLEX.next_force(2.5, True, False, 0.01) == 2.5


def test_it_closes_while_the_object_slips_as_fast_as_it_may():
    assert REFLEX.next_force(2.0, True, True, 0.01) == pytest.approx(2.2)
    assert REFLEX.next_force(0.0, True, True, 0.01) == pytest.approx(1.2)


@pytest.mark.parametrize('interval, counts', [(float('nan'), 0.0), (-1.0, 0.0), (0.0, 0.0), (30.0, LONGEST_S)])
def test_time_that_is_not_known_or_a_gap_does_not_close_it_far(interval, counts):
    assert REFLEX.next_force(1.0, True, True, interval) == pytest.approx(1.0 + 20.0 * counts)


def grip(reflex, until):
    """(scene, true states, forces commanded) frame by frame; what the estimator tells of one commands the gripper in the next."""
    scene, truth, forces = HeldScene(RATE), [], [0.0]
    estimator = taxel_estimator({**defaults(TAXEL_PARAMETERS), 'calibration': str(CALIBRATION)})
    for k in range(round(until * RATE)):
        values, true = scene.render(k / RATE)
        result = estimator.process(values, 1 + k / RATE)
        forces.append(reflex.next_force(forces[-1], bool(result.contacts), result.slip.state != NO_SLIP, 1 / RATE))
        scene.grip += np.clip(forces[-1] - scene.grip, -GRIPPER / RATE, GRIPPER / RATE)
        truth.append(true.slip_state)
    return scene, truth, np.array(forces[1:])


@pytest.mark.full
def test_without_a_reflex_the_object_is_lost():
    assert grip(Reflex(1.0, 10.0, 0.0), 4.5)[0].lost


@pytest.mark.full
def test_with_it_the_object_is_held_until_it_is_taken_away_and_the_command_comes_about_the_onset():
    """The pull grows by 3 N/s; measured: 0.06 s after a twentieth of the contact slips; it slides 0.2 mm in all."""
    scene, truth, forces = grip(Reflex(), 6.0)
    onset = truth.index(INCIPIENT)
    closing = np.flatnonzero((np.diff(forces) > 0) & (forces[:-1] > 0)) + 1
    assert not scene.lost and scene.slid < 1e-3
    assert -0.1 <= (closing[0] - onset) / RATE < 0.4
    assert forces.max() < 10.0 and forces[540] > 1.0 and forces[-1] == 0.0
