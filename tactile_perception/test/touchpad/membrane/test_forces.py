# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument
from tactile_perception.touchpad.membrane.forces import MembraneForces, MembraneMaterial
from tactile_perception.touchpad.membrane.mesh import GridMesh

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


def test_a_tension_that_the_membrane_cannot_carry_is_refused():
    with pytest.raises(BadArgument, match='shear_stiffness'):
        MembraneMaterial(shear_stiffness=15.0, rest_pressure=2000.0, rest_curvature_radius=0.02)


def test_an_inflated_sphere_is_in_balance_at_the_pressure_of_a_neo_hookean_balloon():
    forces, stretch = _forces(), 1.08
    tension = 90.0 * (1 - (1 - 20.0 / 90.0) / stretch**6)
    pressure = 2 * tension / (stretch * RADIUS)
    left, share = forces.evaluate(stretch * _patch().T, pressure)
    load = np.linalg.norm(left, axis=0) / (pressure * np.linalg.norm(share, axis=0))
    assert load[forces.mesh.inner].max() < 0.02
    assert pressure > 4000


def test_nothing_is_left_over_at_rest():
    left, share = _forces().evaluate(_patch().T, 2000.0)
    np.testing.assert_allclose(left / (2000.0 * np.linalg.norm(share, axis=0)), 0, atol=1e-9)


def test_slopes_along_the_rays_are_those_of_the_force():
    forces, rng = _forces(), np.random.default_rng(2)
    x = _patch().T * (1 + 0.01 * np.sin(200 * _patch()[:, :1].T))
    rays = x - np.array([[0.0], [0.0], [-0.03]])
    rays = rays / np.linalg.norm(rays, axis=0)
    leftover, slopes, by_pressure, normal, area = forces.along_rays(x, rays, 3000.0)
    step = rng.normal(size=SIDE**2) * 1e-9
    before, after = forces.evaluate(x, 3000.0)[0], forces.evaluate(x + step * rays, 3000.0)[0]
    inner = forces.mesh.inner
    change = ((after - before) * normal).sum(0)[inner]
    expected = (slopes * step[forces.mesh.stencil]).sum(0)[inner]
    assert np.abs(change - expected).max() < 1e-5 * np.abs(expected).max()
    higher = forces.evaluate(x, 3001.0)[0]
    np.testing.assert_allclose(((higher - before) * normal).sum(0)[inner], by_pressure[inner], rtol=1e-6)
    np.testing.assert_allclose((before * normal).sum(0), leftover, atol=1e-12)
    assert area[inner].min() > 1e-6
