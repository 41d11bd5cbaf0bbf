# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Equilibria of the kernel against the energy of the sheet: its derivative is the force of the tip, and lies within friction's cone."""
import os
from pathlib import Path

import numpy as np
import pytest
from sheet_reference import read_field
from tactile_perception.errors import BadArgument
from tactile_perception.press.sheet.library import LibraryPlan
from tactile_perception.press.sheet.mechanics import SheetMaterial, SheetMesh, basis, locate, may_be_pressed, press_sheet, spread, uniform

PLAN = LibraryPlan((0.030, 0.0225), 7e-3, 12e-3)


def fields(place, depths, radius, material):
    mesh = SheetMesh(place, PLAN.half, PLAN.scale, PLAN.n)
    solved, _ = press_sheet(mesh, depths, radius, material)
    return uniform(solved.reshape(-1, mesh.side, mesh.side, 3)).reshape(len(depths), -1, 3)


def test_a_taut_sheet_under_a_shallow_tip_is_a_drum_skin():
    """Far from the tip a taut membrane hangs as a logarithm: heights at two distances have the ratio of Laplace's equation."""
    field = fields((0.0, 0.0), np.array([1e-4]), 7e-3, SheetMaterial(1.5, 1e-9, 0.5))[0]
    heights = read_field(field, PLAN, (0.0, 0.0), np.array([[0.004, 0.0], [0.008, 0.0], [0.0, 0.008], [0.012, 0.0]]))[:, 0, 2]

    def drum(x, y, a=0.060, b=0.045):  # Green's function of the rectangle, series along x
        m = np.arange(1, 400)
        inside = np.sinh(m * np.pi * (b / 2 - abs(y)) / a) / np.cosh(m * np.pi * b / 2 / a)
        return np.sum(np.sin(m * np.pi / 2) * np.sin(m * np.pi * (x + a / 2) / a) * inside / m)
    exact = np.array([drum(0.004, 1e-9), drum(0.008, 1e-9), drum(0.0, 0.008), drum(0.012, 1e-9)])
    assert heights / heights[1] == pytest.approx(exact / exact[1], rel=0.02)


def test_the_tip_stands_where_it_is_told():
    material = SheetMaterial(1.03, 2e-7, 0.6)
    for k, (field, depth) in enumerate(zip(fields((0.012, 0.008), np.array([2e-3, 5e-3, 9e-3]), 7e-3, material), (2e-3, 5e-3, 9e-3))):
        moved = read_field(field, PLAN, (0.012, 0.008), np.array([[0.012, 0.008]]))[0, 0]
        assert moved[2] == pytest.approx(-depth, abs=3e-5) and np.abs(moved[:2]).max() < 1.2e-3


def test_friction_drags_less_when_there_is_none():
    rest = np.array([[0.012, 0.008]])
    pressed = {f: fields((0.012, 0.008), np.linspace(1e-3, 8e-3, 8), 7e-3, SheetMaterial(1.03, 2e-7, f))[-1] for f in (0.0, 0.8)}
    slid = {f: read_field(field, PLAN, (0.012, 0.008), rest) for f, field in pressed.items()}
    assert np.linalg.norm(slid[0.8][0, 0, :2]) < np.linalg.norm(slid[0.0][0, 0, :2])


def test_a_recorded_press_is_reproduced():
    path = Path(os.environ.get('TACTILE_RECORDINGS', '')) / 'simulated' / 'as_calib_small' / 'truth.npz'
    if not path.exists():
        pytest.skip('set TACTILE_RECORDINGS to the folder of recordings to run this')
    truth = np.load(path)
    rest, press = truth['dot_rest_xyz'].astype(float), np.flatnonzero(truth['segment'] == 1)
    way = PLAN.load_steps(truth['depth'][press].astype(float))
    solved = fields(truth['obj_p'][press[0], :2].astype(float), way, 7e-3, SheetMaterial(1.03, 2e-7, 0.6))
    for k, depth in zip(press, truth['depth'][press]):
        field = solved[np.argmin(np.abs(way - depth))]
        off = rest + read_field(field, PLAN, truth['obj_p'][k, :2].astype(float), rest[:, :2])[:, 0] - truth['dot_xyz'][k]
        assert np.sqrt(np.mean(off**2)) < 3e-5 and np.abs(off).max() < 1.5e-4


def test_what_is_no_sheet_is_refused():
    with pytest.raises(BadArgument, match='prestretch'):
        SheetMaterial(0.9)


HALF, SCALE = np.array([0.030, 0.0225]), 8e-3


@pytest.mark.parametrize('pressed', [(0.0, 0.0), (0.023, -0.016), (-0.02, 0.003)])
def test_locate_undoes_spread(pressed):
    xi = np.linspace(-1, 1, 41)
    place = np.stack([spread(xi, pressed[axis], HALF[axis], SCALE)[0] for axis in (0, 1)])
    assert place[:, [0, -1]] == pytest.approx(np.stack([-HALF, HALF], axis=1))
    assert locate(place, pressed, HALF, SCALE)[0] == pytest.approx(np.stack([xi, xi]), abs=1e-9)


def test_spread_tells_its_derivatives():
    xi, h = np.linspace(-0.95, 0.95, 20), 1e-6
    _, first, second = spread(xi, 0.01, 0.03, SCALE)
    (up, first_up, _), (down, first_down, _) = (spread(xi + step, 0.01, 0.03, SCALE) for step in (h, -h))
    assert first == pytest.approx((up - down) / (2 * h), rel=1e-6) and second == pytest.approx((first_up - first_down) / (2 * h), abs=1e-6)


def test_too_near_to_the_clamp_is_refused():
    with pytest.raises(BadArgument, match='clamp'):
        locate(np.zeros((2, 1)), (0.026, 0.0), HALF, SCALE)


def test_splines_add_up_to_one_and_tell_their_derivatives():
    xi, h = np.linspace(-0.999, 0.999, 50), 1e-6
    first, values = basis(xi, 8)
    assert values[:, 0].sum(1) == pytest.approx(np.ones(50)) and np.abs(values[:, 1:].sum(2)).max() < 1e-9
    field = np.random.default_rng(0).normal(size=10)

    def at(x, order):
        first, values = basis(x, 8)
        return np.sum(values[:, order] * field[first[:, None] + np.arange(3)], axis=1)
    assert at(xi, 1) == pytest.approx((at(xi + h, 0) - at(xi - h, 0)) / (2 * h), abs=1e-5)
    assert at(xi, 2) == pytest.approx((at(xi + h, 1) - at(xi - h, 1)) / (2 * h), abs=1e-4)


def test_presses_just_far_enough_from_the_clamp_count():
    """0.0225 - 0.0165 is a little less than 0.006 in floating point."""
    places = np.array([(0.024, 0.0165), (0.0, -0.0166), (-0.0241, 0.0), (np.nan, np.nan)])
    assert may_be_pressed(places, np.array([0.030, 0.0225]), 0.008).tolist() == [True, False, False, False]
    locate(np.zeros((2, 1)), places[0], np.array([0.030, 0.0225]), 0.008)


def test_the_mesh_integrates_over_the_sheet():
    mesh = SheetMesh((0.01, -0.005), HALF, SCALE, 5)
    assert mesh.weight.sum() == pytest.approx(4 * HALF.prod(), rel=1e-9)
    assert np.sum(mesh.weight * mesh.rest[..., 0] ** 2) == pytest.approx(4 * HALF[1] * HALF[0] ** 3 / 3, rel=2e-3)


def test_uniform_splines_show_the_same_field():
    n, xi = 4, np.linspace(-1, 0.9999, 30)
    open_ends = np.zeros((10, 10, 1))
    open_ends[1:-1, 1:-1] = np.random.default_rng(1).normal(size=(8, 8, 1))
    first, values = basis(xi, 2 * n)
    expected = np.einsum('ki,kj,kij->k', values[:, 0], values[:, 0], open_ends[(first[:, None] + np.arange(3))[:, :, None],
                                                                              (first[:, None] + np.arange(3))[:, None, :], 0])
    f = (xi + 1) * n - first
    weight = np.stack([(1 - f)**2 / 2, 0.5 + f - f * f, f * f / 2], axis=1)
    near = uniform(open_ends)[(first[:, None] + np.arange(3))[:, :, None], (first[:, None] + np.arange(3))[:, None, :], 0]
    assert np.einsum('ki,kj,kij->k', weight, weight, near) == pytest.approx(expected, abs=1e-12)


PLACE, RADIUS, DEPTHS = np.array([0.008, 0.004]), 7e-3, np.linspace(1e-3, 5e-3, 5)
MESH = SheetMesh(PLACE, np.array([0.030, 0.0225]), 8e-3, 5)


def energy(field, material):
    """Per shear modulus times thickness, of splines displaced by field (side * side, 3)."""
    edges = np.einsum('egai,eik->egak', MESH.slope, field[MESH.nodes]) + np.eye(2, 3)
    area = np.sum(np.cross(edges[..., 0, :], edges[..., 1, :])**2, axis=-1)
    bent = np.einsum('egi,eik->egk', MESH.laplacian, field[MESH.nodes])
    stored = (np.sum(edges**2, axis=(-2, -1)) + material.prestretch**-6 / area + material.bending * np.sum(bent**2, axis=-1)) / 2
    return float(np.sum(stored * MESH.weight))


def forces(field, material):
    """(side, side, 3) of the tip on the inner splines: derivative of the energy."""
    found, h = np.zeros_like(field).reshape(MESH.side, MESH.side, 3), 1e-6
    for i, j, k in np.ndindex(MESH.side - 2, MESH.side - 2, 3):
        way = np.zeros_like(found)
        way[i + 1, j + 1, k] = h
        ahead, behind = (energy(field + sign * way.reshape(-1, 3), material) for sign in (1, -1))
        found[i + 1, j + 1, k] = (ahead - behind) / (2 * h)
    return found


@pytest.mark.parametrize('friction, drag', [(0.0, None), (0.6, None), (0.6, (0.4, -0.2)), (0.6, (0.0, 0.0))])
def test_the_tip_holds_the_sheet_and_nothing_else_does(friction, drag):
    material = SheetMaterial(1.05, 2e-7, friction)
    field, wrench = (part[-1] for part in press_sheet(MESH, DEPTHS, RADIUS, material, drag))
    push = forces(field, material)
    assert push.sum(axis=(0, 1)) == pytest.approx(wrench[:3], abs=2e-3 * -wrench[2])
    xi = np.concatenate([[-1], np.arange(-0.9, 1, 0.2), [1]])
    far = np.hypot(xi[:, None], xi) > 0.85  # no point of these splines is under the tip
    assert np.abs(push[far]).max() < 1e-4 * -wrench[2] < -wrench[2]


def test_a_tip_that_slides_drags_with_its_traction():
    material = SheetMaterial(1.05, 2e-7, 0.0)
    (still, by_still), (slid, by_slid) = (press_sheet(MESH, DEPTHS, RADIUS, material, drag) for drag in ((0.0, 0.0), (0.5, 0.0)))
    straight, by_straight = press_sheet(MESH, DEPTHS, RADIUS, material)
    assert still == pytest.approx(straight, abs=1e-8) and by_still == pytest.approx(by_straight, abs=1e-8)
    more = by_slid[-1, 0] / by_slid[-1, 2] - by_still[-1, 0] / by_still[-1, 2]
    assert -more == pytest.approx(0.5, rel=0.25)  # per normal pressure on a round tip
    assert slid[-1].reshape(MESH.side, MESH.side, 3)[MESH.side // 2, MESH.side // 2, 0] > 1e-4


def test_without_equilibrium_there_is_no_number():
    fields, wrenches = press_sheet(MESH, np.array([1e-3, np.nan, 2e-3]), RADIUS, SheetMaterial())
    assert np.isfinite(fields[0]).all() and np.isnan(fields[1:]).all() and np.isnan(wrenches[1:]).all()
