# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest
from taxel_pictures import ARRAY, bar, picture
from tactile_perception.taxel.pressure import SoftPad
from tactile_perception.taxel.wrench import normal_force, pressure_centre, under_friction


def test_normal_force_of_equation_5():
    assert normal_force(200e-6, 4e-4, SoftPad(thickness=0.002, stiffness=3e5)) == pytest.approx(12.0)


PAD = SoftPad()


def test_pressure_acts_where_the_load_is():
    everywhere = np.ones((44, 44), bool)
    assert pressure_centre(picture(bar(4.0, -3.0)), everywhere, ARRAY, PAD) == pytest.approx([4e-3, -3e-3], abs=2e-5)
    assert np.isnan(pressure_centre(np.zeros((44, 44), np.float32), everywhere, ARRAY, PAD)).all()


@pytest.mark.parametrize('thickness', [1e-3, 3e-3])
def test_moments_about_the_taxels_balance_under_friction_though_no_tension_is_seen(thickness):
    pad, friction = SoftPad(thickness=thickness), np.array([4.0, -2.0])
    touched = np.zeros((44, 44), bool)
    touched[16:26, 18:36] = True
    load = cv2.GaussianBlur(5e4 * touched.astype(np.float32), (0, 0), 0.7)
    centre, normal = pressure_centre(load, touched, ARRAY, PAD), 1e-6 * float(load.sum())
    even = cv2.GaussianBlur(touched / np.float32(touched.sum() * 1e-6), (0, 0), 1.2e3 * thickness)
    slopes = friction[0] * np.gradient(even, axis=1) + friction[1] * np.gradient(even, axis=0)
    shown = np.maximum(load - thickness * 1e3 * slopes, 0).astype(np.float32)
    found = under_friction(shown, touched, friction, ARRAY, pad)
    arm = thickness * np.hypot(*friction) / normal
    by_the_seen_alone = pressure_centre(shown, touched, ARRAY, pad) - thickness * friction / normal
    assert np.hypot(*(found - centre)) < 0.06 * arm and np.hypot(*(by_the_seen_alone - centre)) > 0.1 * arm
