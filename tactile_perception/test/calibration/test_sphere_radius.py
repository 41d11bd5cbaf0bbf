# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The radius at which the misfit is least, to a hundredth; none where there is no least one."""
import numpy as np
import pytest
from tactile_perception.calibration.sphere_radius import LARGEST, SMALLEST, TOLERANCE, find_sphere_radius
from tactile_perception.errors import BadCalibration


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


def test_where_nothing_fits_it_is_said():
    def misfit(_radius):
        raise BadCalibration('x')
    with pytest.raises(BadCalibration, match=f'{SMALLEST * 1e3:.0f} to {LARGEST * 1e3:.0f} mm'):
        find_sphere_radius(misfit)
