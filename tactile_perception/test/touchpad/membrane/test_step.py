# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.spherical_cap import Cap
from tactile_perception.touchpad.membrane.forces import MembraneForces, MembraneMaterial
from tactile_perception.touchpad.membrane.mesh import GridMesh
from tactile_perception.touchpad.membrane.step import MembraneFrame, Slopes

ORIGIN, SIDE = np.array([0.0, 0.0, -0.04]), 11


@pytest.fixture(scope='module')
def pad():
    y, x = np.meshgrid(np.linspace(-0.15, 0.15, SIDE), np.linspace(-0.15, 0.15, SIDE), indexing='ij')
    rays = np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    rest = Cap().meet(ORIGIN, rays)
    return rest, rays, MembraneForces(GridMesh(SIDE, SIDE), rest, MembraneMaterial())


def _frame(pad, ranges, sigma=20e-6, ids=None, touched=None):
    rest, rays, forces = pad
    ids = np.arange(SIDE**2) if ids is None else ids
    return MembraneFrame(forces, Slopes(forces), ORIGIN, rays[ids], ranges[ids], np.full(len(ids), sigma), ids, rest.T, touched, 2000.0)


def test_a_step_from_a_bent_start_goes_to_the_measured_shape(pad):
    ranges = np.linalg.norm(pad[0] - ORIGIN, axis=1)
    frame = _frame(pad, ranges)
    frame.ranges = ranges + 50e-6 * np.cos(np.arange(SIDE**2))
    for _ in range(2):
        frame.step(0.06, classify=False, robust=True, final=False)
    assert np.abs(frame.ranges - ranges).max() < 1e-6
    assert frame.pressure == pytest.approx(2000, rel=1e-3)


def test_a_range_that_goes_alone_is_left_out_and_an_edge_is_not(pad):
    ranges = np.linalg.norm(pad[0] - ORIGIN, axis=1)
    spoiled = ranges.copy()
    spoiled[60] += 0.4e-3
    assert np.flatnonzero(_frame(pad, spoiled).weight == 0).tolist() == [60]
    edge = ranges.reshape(SIDE, SIDE).copy()
    edge[5] -= 0.4e-3
    assert (_frame(pad, edge.ravel()).weight > 0).all()


def test_dots_not_seen_move_as_their_neighbours(pad):
    rest, rays, forces = pad
    ids = np.setdiff1d(np.arange(SIDE**2), [60, 61])
    turned = rays + [0.01, 0, 0]
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    ranges = np.linalg.norm(rest - ORIGIN, axis=1)
    frame = MembraneFrame(forces, Slopes(forces), ORIGIN, turned[ids], ranges[ids], np.full(len(ids), 1e-5), ids, rest.T, None, 2000.0)
    assert not frame.seen[[60, 61]].any() and frame.weight[60] == 0
    np.testing.assert_allclose(frame.rays[:, [60, 61]].T, turned[[60, 61]], atol=1e-4)


def test_a_jump_of_the_surface_starts_from_the_measured_ranges(pad):
    ranges = np.linalg.norm(pad[0] - ORIGIN, axis=1)
    free = np.zeros(SIDE**2)
    assert not _frame(pad, ranges - 0.2e-3, touched=free).cold
    jumped = _frame(pad, ranges - 2e-3, touched=free)
    assert jumped.cold
    np.testing.assert_allclose(jumped.ranges, ranges - 2e-3)


def test_slopes_are_kept_until_many_dots_have_gone_far(pad):
    rest, rays, forces = pad
    slopes, x, along = Slopes(forces), np.ascontiguousarray(rest.T), np.ascontiguousarray(rays.T)
    normal = forces.balance(x, 2000.0)[2]
    first = slopes.at(x, normal, along, 2000.0)
    spoiled = x.copy()
    spoiled[:, 60] -= 1e-3
    assert slopes.at(x - 1e-4 * along, normal, along, 2000.0) is first and slopes.at(spoiled, normal, along, 2000.0) is first
    assert slopes.at(x - 6e-4 * along, normal, along, 2000.0) is not first


def test_equations_are_kept_while_their_weights_are_about_the_same(pad):
    rest, rays, forces = pad
    slopes, x, along = Slopes(forces), np.ascontiguousarray(rest.T), np.ascontiguousarray(rays.T)
    normal, area = forces.balance(x, 2000.0)[2:]
    rows = slopes.at(x, normal, along, 2000.0)
    weight, trust = forces.mesh.inner * 1e3, np.full(SIDE**2, 2e9)
    first = slopes.equations(rows, weight, area, trust, keep=0.4)
    some, one, all_ = trust.copy(), trust.copy(), 1.7 * trust
    some[:10] *= 3
    one[0] *= 9
    assert slopes.equations(rows, weight, area, some, keep=0.4) is first
    assert slopes.equations(rows, weight, area, trust, keep=0.2) is not first
    assert slopes.equations(rows, weight, area, trust, keep=None) is not first
    for other in (one, all_):
        slopes.equations(rows, weight, area, trust, keep=0.4)
        found = slopes.equations(rows, weight, area, other, keep=0.4)
        np.testing.assert_array_equal(found.factor, Slopes(forces).equations(rows, weight, area, other, keep=None).factor)
    slopes.at(x - 6e-4 * along, normal, along, 2000.0)
    assert slopes.equations(rows, weight, area, all_, keep=0.4) is not found


def test_equations_are_solved_for_ranges_and_pressure_together(pad):
    rest, rays, forces = pad
    slopes, x, along = Slopes(forces), np.ascontiguousarray(rest.T), np.ascontiguousarray(rays.T)
    normal, area = forces.balance(x, 2000.0)[2:]
    weight, trust = forces.mesh.inner * 1e3, np.full(SIDE**2, 1e3)
    rows = slopes.at(x, normal, along, 2000.0)
    dense = np.zeros((SIDE**2, SIDE**2 + 1))
    dense[np.arange(SIDE**2)[None], forces.mesh.stencil] = np.where(forces.mesh.inner, rows, 0)
    dense[:, -1] = np.where(forces.mesh.inner, area, 0)
    gradient = np.random.default_rng(0).normal(size=SIDE**2 + 1)
    expected = np.linalg.solve(dense.T @ (1e3 * dense) + np.diag(np.r_[trust, 0]), gradient)
    equations = slopes.equations(rows, weight, area, trust, keep=None)
    moved, change = equations.solve(gradient[:-1], gradient[-1])
    np.testing.assert_allclose(moved + change * equations.by_border, expected[:-1], rtol=1e-4, atol=1e-6 * np.abs(expected[:-1]).max())
    assert -change == pytest.approx(expected[-1], rel=1e-4)
