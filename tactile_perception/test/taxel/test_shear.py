# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.taxel.pressure import SoftPad
from tactile_perception.taxel.motion import MotionTracker
from taxel_pictures import ARRAY, bar, picture

PAD = SoftPad(thickness=0.002, shear_modulus=1e5, friction=0.5)
TOUCHED = picture(bar(), blur=0.1) > 30
PRESSURE = picture(bar(), 30e3)


def drag(shear, distance, steps=40):
    return [shear.move(TOUCHED, PRESSURE, np.array([distance / steps, 0.0, 0.0]), PAD.friction) for _ in range(steps)]


def test_a_small_drag_sticks_and_pulls_at_least_by_the_pads_stiffness():
    shear = MotionTracker(ARRAY, PAD).shear
    assert np.abs(sum(drag(shear, 2e-5))).max() < 1e-9
    assert 1.0 < shear.force[0] / (5e7 * 2e-5 * 160e-6) < 2.0 and abs(shear.force[1]) < 1e-6


def test_the_rim_slips_first_then_all_by_friction():
    shear = MotionTracker(ARRAY, PAD).shear
    slip = np.hypot(*sum(drag(shear, 2.6e-4)))[TOUCHED]
    assert 0.05 < (slip > 1e-6).mean() < 0.9
    slip = np.hypot(*drag(shear, 1e-3)[-1])
    assert (slip[TOUCHED] > 1e-6).all() and slip[~TOUCHED].max() < 1e-9
    assert shear.force[0] == pytest.approx(0.5 * PRESSURE[TOUCHED].sum() * 1e-6, rel=0.12)


def test_the_picture_runs_ahead_and_its_moment_balances_the_traction():
    shear = MotionTracker(ARRAY, PAD).shear
    assert not shear.traction_pressure().any()
    drag(shear, 1e-3)
    lead = shear.traction_pressure()
    assert lead.sum() == pytest.approx(0, abs=1e-2 * np.abs(lead).sum())
    assert (lead * ARRAY.x).sum() * 1e-6 == pytest.approx(PAD.thickness * shear.force[0], rel=0.05)
