# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Taxels as points: forces that add up to those of the contacts, and the estimator's states."""
import cv2
import numpy as np
import pytest
from taxel_pictures import ARRAY, bar, both, disc, picture

from tactile_perception._core.taxel import SurfaceShear
from tactile_perception.common.estimates import GROSS
from tactile_perception.common.surface_points import SLIPPING, STICKING, UNKNOWN
from tactile_perception.taxel.estimator import TAXEL_METHODS, TaxelEstimator, TaxelSettings
from tactile_perception.taxel.pressure import SoftPad, pad_on
from tactile_perception.taxel.response import Response
from tactile_perception.taxel.wrench import GraspedObject

PAD, PER_COUNT = SoftPad(), 500.0  # Pa
KNOWN = TaxelSettings(response=Response((PER_COUNT, 0.0, 0.0), known=True))
TWO = both(bar(-11, 0, 0, 8, 8), disc(10, 3, 5))


def result_of(image, settings=KNOWN, grasped=GraspedObject()):
    """The estimator's result of a picture after some untouched ones."""
    estimator = TaxelEstimator(ARRAY, PAD, settings)
    estimator.grasped = grasped
    for k in range(8):
        estimator.process(np.full((44, 44), 3, np.uint8), 1 + 0.01 * k)
    return estimator.process(np.clip(np.round(image + 3), 0, 255).astype(np.uint8), 1.1)


@pytest.mark.parametrize('method', TAXEL_METHODS)
def test_forces_sum_to_the_wrench_and_its_moment(method):
    result = result_of(picture(TWO), TaxelSettings(method=method, response=KNOWN.response))
    points = result.points()
    assert len(result.contacts) == 2 and points.normal_force.sum() == pytest.approx(sum(c.force for c in result.contacts), rel=1e-5)
    assert points.force[:, 2].sum() == pytest.approx(result.wrench[2], rel=1e-5)
    assert -(points.xyz[:, 1] @ points.normal_force) == pytest.approx(result.wrench[3], rel=1e-4)
    assert points.xyz[:, 0] @ points.normal_force == pytest.approx(result.wrench[4], rel=1e-4)


def test_forces_are_those_that_press_the_pad():
    """A bar of 8 x 8 mm at 60 counts of 500 Pa, and a disc of 5 mm radius."""
    points = result_of(picture(TWO)).points()
    left = points.xyz[:, 0] < 0
    assert points.normal_force[left].sum() == pytest.approx(60 * PER_COUNT * 64e-6, rel=0.02)
    assert points.normal_force[~left].sum() == pytest.approx(60 * PER_COUNT * np.pi * 25e-6, rel=0.02)
    far = np.hypot(points.xyz[:, 0] - 10e-3, points.xyz[:, 1] - 3e-3) > 9e-3
    assert not points.normal_force[far & ~left].any()


def test_points_are_at_the_taxels_and_displaced_by_the_pressure():
    points = result_of(picture(disc(0, 0, 9))).points()
    assert points.shape == (44, 44) and points.xyz[0] == pytest.approx([-21.5e-3, -21.5e-3, 0])
    assert points.xyz[43] == pytest.approx([21.5e-3, -21.5e-3, 0]) and (points.normal == [0, 0, 1]).all()
    middle = 22 * 44 + 22
    assert points.displacement[middle, 2] == pytest.approx(-60 * PER_COUNT * PAD.thickness / PAD.stiffness, rel=0.05)
    assert np.isnan(points.displacement[:, :2]).all() and np.isnan(points.force[:, :2]).all()
    assert points.state[middle] == STICKING and points.state[0] == 0


def test_a_known_depth_gives_the_force_and_pressure_its_distribution():
    result = result_of(picture(TWO), TaxelSettings(), GraspedObject(depth=4e-4))
    points = result.points()
    assert points.normal_force.sum() == pytest.approx(-result.wrench[2], rel=1e-5)
    assert points.normal_force.sum() == pytest.approx(PAD.stiffness / PAD.thickness * 4e-4 * result.region.area, rel=1e-5)
    assert np.isnan(points.displacement).all()


def test_a_broken_image_has_no_forces():
    even = np.indices((44, 44)).sum(axis=0) % 2 * 120.0
    assert np.isnan(result_of(even).points().normal_force).all()


def test_slipping_taxels_are_those_of_the_slip():
    estimator = TaxelEstimator(ARRAY, PAD, KNOWN)
    for k, x in enumerate([None] * 8 + [0.0] * 8 + [0.1 * n for n in range(12)]):
        image = np.zeros((44, 44)) if x is None else picture(bar(x))
        result = estimator.process(np.clip(np.round(image + 3), 0, 255).astype(np.uint8), 1 + 0.01 * k)
    points = result.points()
    slips = points.state == SLIPPING
    assert slips.sum() == len(result.slip.x) > 50 and points.xyz[slips, :2] == pytest.approx(np.stack([result.slip.x, result.slip.y], 1))
    assert set(points.state) <= {0, STICKING, SLIPPING}


def test_a_slip_that_is_not_located_leaves_the_states_unknown():
    estimator = TaxelEstimator(ARRAY, PAD, TaxelSettings(method='paper', response=KNOWN.response))
    for k, x in enumerate((None, 0, 0, 0.4)):
        image = np.zeros((44, 44)) if x is None else picture(bar(x))
        result = estimator.process(np.clip(np.round(image + 3), 0, 255).astype(np.uint8), 1 + 0.1 * k)
        assert set(result.points().state) == ({0} if x is None else {0, STICKING} if k < 3 else {0, UNKNOWN})
    assert result.slip.state == GROSS


def test_the_pressure_centre_is_that_of_the_load():
    shear, everywhere = SurfaceShear(pad_on(ARRAY, PAD)), np.ones((44, 44), bool)
    assert shear.pressure_centre(picture(bar(4.0, -3.0)), everywhere) == pytest.approx([4e-3, -3e-3], abs=2e-5)
    assert np.isnan(shear.pressure_centre(np.zeros((44, 44), np.float32), everywhere)).all()


@pytest.mark.parametrize('thickness', [1e-3, 3e-3])
def test_moments_balance_under_friction_although_tension_is_not_measured(thickness):
    shear, friction = SurfaceShear(pad_on(ARRAY, SoftPad(thickness=thickness))), np.array([4.0, -2.0])
    touched = np.zeros((44, 44), bool)
    touched[16:26, 18:36] = True
    load = cv2.GaussianBlur(5e4 * touched.astype(np.float32), (0, 0), 0.7)
    centre, normal = shear.pressure_centre(load, touched), 1e-6 * float(load.sum())
    even = cv2.GaussianBlur(touched / np.float32(touched.sum() * 1e-6), (0, 0), 1.2e3 * thickness)
    slopes = friction[0] * np.gradient(even, axis=1) + friction[1] * np.gradient(even, axis=0)
    shown = np.maximum(load - thickness * 1e3 * slopes, 0).astype(np.float32)
    found = shear.pressure_centre(shown, touched, friction)
    arm = thickness * np.hypot(*friction) / normal
    by_the_seen_alone = shear.pressure_centre(shown, touched) - thickness * friction / normal
    assert np.hypot(*(found - centre)) < 0.06 * arm and np.hypot(*(by_the_seen_alone - centre)) > 0.1 * arm
