# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from taxel_pictures import ARRAY, bar, picture
from tactile_perception.taxel.array import SoftPad
from tactile_perception.taxel.wrench import GraspedObject, normal_force, pressure_centre, transform_wrench, under_friction, wrench_of


def test_normal_force_of_equation_5():
    assert normal_force(200e-6, 4e-4, SoftPad(thickness=0.002, stiffness=3e5)) == pytest.approx(12.0)


def test_without_an_object_only_what_pressure_tells():
    wrench = wrench_of(10.0, np.array([0.002, -0.003]), np.zeros(3), GraspedObject())
    assert wrench[2:5] == pytest.approx([-10.0, 0.03, 0.02]) and np.isnan(wrench[[0, 1, 5]]).all()


PAD = SoftPad()


def test_pressure_acts_where_the_load_is():
    everywhere = np.ones((44, 44), bool)
    assert pressure_centre(picture(bar(4.0, -3.0)), everywhere, ARRAY, PAD) == pytest.approx([4e-3, -3e-3], abs=2e-5)
    assert np.isnan(pressure_centre(np.zeros((44, 44), np.float32), everywhere, ARRAY, PAD)).all()


def test_moments_about_the_taxels_balance_under_friction():
    pad, normal, friction, centre = SoftPad(thickness=0.002), 10.0, np.array([3.0, -1.0]), np.array([4e-3, 1e-3])
    about_taxels = normal * centre + pad.thickness * friction  # of what acts on the surface, a thickness above
    assert under_friction(about_taxels / normal, normal, friction, pad) == pytest.approx(centre)
    assert under_friction(centre, 0.0, friction, pad) is centre


def test_each_finger_holds_half_of_the_weight():
    grasped = GraspedObject(weight=np.array([0.0, 2.0, 0.0]), centre_of_mass=np.array([0.01, 0.0, -0.01]))
    wrench = wrench_of(10.0, np.zeros(2), np.array([0.0, 0.0, -1e-3]), grasped)
    assert wrench == pytest.approx([0, 1.0, -10.0, 1e-3, 0, 0.01])


def test_shifted_to_another_frame_keeps_the_work():
    rng = np.random.default_rng(0)
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    rotation *= np.sign(np.linalg.det(rotation))
    translation, wrench = rng.normal(size=3), rng.normal(size=6)
    place = rng.normal(size=3)
    moved = transform_wrench(wrench, rotation, translation)
    about = moved[3:] - np.cross(rotation @ place + translation, moved[:3])
    assert about == pytest.approx(rotation @ (wrench[3:] - np.cross(place, wrench[:3])))
