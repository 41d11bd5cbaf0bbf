# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.estimates import GROSS, INCIPIENT, NONE
from tactile_perception.taxel.motion import ObjectMotion, TaxelSlip
from taxel_pictures import ARRAY, bar, picture

TOUCHED = picture(bar(2, 0), blur=0.1) > 30


def motion(slipping, linear=(0.0, 0.0), turn=0.0):
    return ObjectMotion(np.array(linear), turn, slipping, np.zeros(2), 0.0)


def test_states_by_the_part_that_slips():
    slip = TaxelSlip(ARRAY)
    rim = TOUCHED & ~np.roll(TOUCHED, 2, axis=1)
    states = [slip.process(motion(part & TOUCHED), TOUCHED).state for part in (~TOUCHED, rim, TOUCHED, ~TOUCHED)]
    assert states == [NONE, INCIPIENT, GROSS, NONE]


def test_centre_of_rotation_and_velocities():
    centre, turn = np.array([4e-3, 3e-3]), 0.5
    linear = turn * np.array([centre[1], -centre[0]])
    found = TaxelSlip(ARRAY).process(motion(TOUCHED, linear, turn), TOUCHED)
    assert found.rotation_center[:2] == pytest.approx(centre) and found.angular[2] == turn
    assert found.vx == pytest.approx(-turn * (found.y - centre[1])) and found.vy == pytest.approx(turn * (found.x - centre[0]))
