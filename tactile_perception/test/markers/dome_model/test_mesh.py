# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.geometry import Cap
from tactile_perception.markers.dome_model.mesh import DomeMesh, MeshPlan, disc_of, evaluate, shift_of

CAP, PLAN = Cap(0.15375, 0.12), MeshPlan(even=6, rings=12, width=0.02, harmonics=3, around=8)


def test_rings_grow_from_the_touch_to_the_rim():
    widths = np.diff(PLAN.edges)
    assert PLAN.edges[[0, -1]] == pytest.approx([0, 1]) and np.ptp(widths[:6]) < 1e-9 and (np.diff(widths[5:]) > 0).all()


@pytest.mark.parametrize('across', [0.0, 0.05])
def test_points_lie_on_the_dome_around_the_touch_and_slopes_are_their_derivatives(across):
    mesh = DomeMesh(shift_of(across, 0.02, CAP), CAP, PLAN)
    from_centre = mesh.rest - [0, 0, CAP.centre_z]
    assert np.allclose(np.linalg.norm(from_centre, axis=-1), CAP.curvature_radius) and mesh.rest[..., 2].min() > 0
    touch = np.array([across, 0, np.sqrt((CAP.curvature_radius + 0.02)**2 - across**2)]) / (CAP.curvature_radius + 0.02)
    assert np.allclose(from_centre[0].mean(0) / CAP.curvature_radius, touch, atol=0.02)
    for slope in (mesh.along, mesh.across):  # angles are preserved: both have the length of the scale, and are perpendicular
        assert np.allclose(np.linalg.norm(slope, axis=-1), mesh.scale)
        assert np.abs(np.sum(slope * from_centre, axis=-1)).max() < 1e-9
    assert np.abs(np.sum(mesh.along * mesh.across, axis=-1)).max() < 1e-9
    area = 2 * np.sum(mesh.weight * mesh.scale**2)
    assert area == pytest.approx(2 * np.pi * CAP.curvature_radius * CAP.height, rel=2e-3)


@pytest.mark.parametrize('odd', [False, True])
def test_the_basis_at_the_points_is_the_field_there(odd):
    mesh = DomeMesh(0.2, CAP, PLAN)
    field = np.where(mesh.free(odd), np.random.default_rng(0).normal(0, 1e-3, PLAN.size), 0.0)
    value, _ = mesh.basis(odd)
    by_basis = np.matmul(value, field[mesh.of][..., None]).reshape(-1, 3)
    assert np.allclose(by_basis, evaluate(field, mesh, mesh.rest.reshape(-1, 3), odd), atol=1e-9)


def test_the_rim_is_the_unit_circle_and_beyond_it_nothing_moves():
    turn = np.linspace(0, 6, 7)
    rim = CAP.rim_radius * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    assert np.allclose(np.abs(disc_of(rim, CAP)), 1.0)
    mesh = DomeMesh(0.2, CAP, PLAN)
    assert not evaluate(np.ones(PLAN.size), mesh, rim - [0, 0, 0.01]).any()
