# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument
from tactile_perception.touchpad.membrane import MembraneForces, MembraneMaterial, GridMesh

RADIUS, SIDE = 0.020, 23


def _patch():
    """(529, 3) dots on a sphere of 20 mm about the origin, pitch about 1.4 mm, unevenly spaced."""
    rng = np.random.default_rng(1)
    angle = np.linspace(-0.75, 0.75, SIDE)
    y, x = np.meshgrid(np.tan(angle), np.tan(angle), indexing='ij')
    points = np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3) + rng.normal(size=(SIDE**2, 3)) * [0.004, 0.004, 0]
    return RADIUS * points / np.linalg.norm(points, axis=1, keepdims=True)


def _forces(material=None):
    return MembraneForces(GridMesh(SIDE, SIDE), _patch(), material or MembraneMaterial(90.0, 2000.0, RADIUS))


def _left(forces, places, pressure):
    """Residual force (K, 3) of membrane and fluid, N, and area vectors (K, 3), m^2, of the dots."""
    elastic, share = forces.elastic(places)
    return elastic + pressure * (share - forces.rest_residual), share


def test_a_tension_that_the_membrane_cannot_carry_is_refused():
    with pytest.raises(BadArgument, match='shear_stiffness'):
        MembraneMaterial(shear_stiffness=15.0, rest_pressure=2000.0, rest_curvature_radius=0.02)


def test_an_inflated_sphere_is_in_balance_at_the_pressure_of_a_neo_hookean_balloon():
    forces, stretch = _forces(), 1.08
    tension = 90.0 * (1 - (1 - 20.0 / 90.0) / stretch**6)
    pressure = 2 * tension / (stretch * RADIUS)
    left, share = _left(forces, stretch * _patch(), pressure)
    load = np.linalg.norm(left, axis=1) / (pressure * np.linalg.norm(share, axis=1))
    assert load[forces.mesh.inner].max() < 0.02
    assert pressure > 4000


def test_nothing_is_left_over_at_rest():
    left, share = _left(_forces(), _patch(), 2000.0)
    np.testing.assert_allclose(left / (2000.0 * np.linalg.norm(share, axis=0)), 0, atol=1e-9)
