# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The held object: balance of forces while friction suffices, loss where it does not."""
import pytest
from tactile_driver.simulation.taxel.held_object import HeldScene
from tactile_driver.simulation.truth import GROSS, INCIPIENT, NO_SLIP

RATE = 100.0


def played(until, grip=0.0):
    """(scene, truth of each frame) up to a time, s, under a steady grip, N."""
    scene, told = HeldScene(RATE), []
    scene.grip = grip
    for k in range(round(until * RATE) + 1):
        told.append(scene.render(k / RATE)[1])
    return scene, told


def test_what_is_gripped_firmly_stays_and_carries_the_pull():
    scene, told = played(3.5, grip=18.0)
    assert not scene.lost and scene.slid < 0.3e-3
    assert told[-1].wrench[1] == pytest.approx(scene.pull(3.5), rel=0.02) and scene.pull(3.5) == 3.0
    assert told[-1].wrench[2] == pytest.approx(-19.5, rel=0.02)
    assert {frame.slip_state for frame in told[170:]} == {NO_SLIP}


def test_what_is_hardly_touched_slips_more_and_more_and_is_lost():
    scene, told = played(3.0)
    states = [frame.slip_state for frame in told]
    assert scene.lost and not told[-1].contacts
    assert states.index(INCIPIENT) < states.index(GROSS)
    assert all(frame.wrench[1] <= scene.specimen.grip * -frame.wrench[2] * 1.001 for frame in told)


def test_a_lost_object_is_back_in_the_next_round():
    scene, _ = played(4.0)
    assert scene.lost
    _, truth = scene.render(7.2)
    assert truth.contacts and not scene.lost
