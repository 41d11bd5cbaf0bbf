# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The radius at which the misfit is least, to a hundredth; none where there is no least one.
Which dots lie on the sphere, and where that puts them."""
import numpy as np
import pytest
from tactile_perception.touchpad.calibration import TOLERANCE, Press, dots_on_sphere, find_sphere_radius
from tactile_perception.errors import BadCalibration
from tactile_perception.touchpad.identification import fit_rest


@pytest.mark.parametrize('radius', [3e-3, 5e-3, 8e-3, 12e-3, 24e-3])
def test_the_least_misfit_is_found(radius):
    found = find_sphere_radius(lambda r: 1e-5 + 1e-4 * abs(np.log(r / radius)))
    assert found == pytest.approx(radius, rel=2 * TOLERANCE)


def test_radii_that_cannot_be_fitted_are_passed_over():
    def misfit(radius):
        if radius < 5e-3:
            raise BadCalibration('no dot lies on the sphere')
        return (radius - 9e-3)**2 + 1e-9
    assert find_sphere_radius(misfit) == pytest.approx(9e-3, rel=0.02)


@pytest.mark.parametrize('misfit', [lambda r: r, lambda r: 1e-3 / r, lambda r: 1e-4 + 0 * r])
def test_no_least_misfit_within_bounds_is_said(misfit):
    with pytest.raises(BadCalibration, match='--sphere-radius'):
        find_sphere_radius(misfit)


@pytest.mark.full
def test_dots_on_the_sphere_are_truly_there(water_pad):
    pad = water_pad()
    model = fit_rest(pad.image(), pad.rest_uv, pad.camera)
    tip = pad.tip(0.002, 0.001, 0.003)
    group = dots_on_sphere(Press(pad.image(tip), pad.tracks(), tip, 0.003), 0.008, model, pad.camera)
    assert 6 <= len(group.count) <= 20
    away = np.linalg.norm(group.colours.places - tip - [0, 0, 0.008], axis=1)
    assert away == pytest.approx(np.full(len(away), 0.008), abs=6e-5)


@pytest.mark.full
def test_a_sphere_outside_of_the_pad_holds_no_dot(water_pad):
    pad = water_pad()
    model = fit_rest(pad.image(), pad.rest_uv, pad.camera)
    press = Press(pad.image(), pad.tracks(), pad.tip(0, 0, -0.004), 0.001)
    assert len(dots_on_sphere(press, 0.008, model, pad.camera).count) == 0
