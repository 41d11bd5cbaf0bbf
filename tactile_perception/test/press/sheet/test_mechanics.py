# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Equilibria of the kernel against the energy of the sheet, whose derivative is the force of the tip, within the friction cone."""
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import griddata

from tactile_perception.core.errors import BadArgument
from tactile_perception.press.sheet.library import LibraryPlan
from tactile_perception.press.sheet.mechanics import SheetMaterial, SheetMesh, may_be_pressed, press_sheet

PLAN = LibraryPlan((0.030, 0.0225), 7e-3, 12e-3)


def moved(position, depths, radius, material):
    """Points (P, 2), m, of the untouched sheet, and their displacements (D, P, 3), m."""
    mesh = SheetMesh(position, PLAN.half, PLAN.scale, PLAN.n)
    solved, _ = press_sheet(mesh, depths, radius, material)
    return mesh.rest.reshape(-1, 2), np.einsum('egi,deik->degk', mesh.value, solved[:, mesh.nodes]).reshape(len(depths), -1, 3)


def test_a_taut_sheet_under_a_shallow_tip_is_a_membrane():
    """Far from the tip a taut membrane hangs as a logarithm: heights have the ratios of Laplace's equation."""
    points, (shift,) = moved((0.0, 0.0), np.array([1e-4]), 7e-3, SheetMaterial(1.5, 1e-9, 0.5))
    ring = np.flatnonzero((np.hypot(*points.T) > 4e-3) & (np.hypot(*points.T) < 13e-3))[::40]

    def drum(x, y, a=0.060, b=0.045):  # Green's function of the rectangle, series along x
        m = np.arange(1, 400)
        inside = np.sinh(m * np.pi * (b / 2 - abs(y)) / a) / np.cosh(m * np.pi * b / 2 / a)
        return np.sum(np.sin(m * np.pi / 2) * np.sin(m * np.pi * (x + a / 2) / a) * inside / m)
    exact = np.array([drum(*points[k]) for k in ring])
    assert len(ring) > 4 and shift[ring, 2] / shift[ring[0], 2] == pytest.approx(exact / exact[0], rel=0.02)


def test_a_recorded_press_is_reproduced():
    path = Path(os.environ.get('TACTILE_RECORDINGS', '')) / 'simulated' / 'as_calib_small' / 'truth.npz'
    if not path.exists():
        pytest.skip('set TACTILE_RECORDINGS to the folder of recordings to run this')
    truth = np.load(path)
    rest, press = truth['dot_rest_xyz'].astype(float), np.flatnonzero(truth['segment'] == 1)
    steps = PLAN.load_steps(truth['depth'][press].astype(float))
    points, shifts = moved(truth['obj_p'][press[0], :2].astype(float), steps, 7e-3, SheetMaterial(1.03, 2e-7, 0.6))
    for k, depth in zip(press, truth['depth'][press]):
        off = rest + griddata(points, shifts[np.argmin(np.abs(steps - depth))], rest[:, :2], 'cubic') - truth['dot_xyz'][k]
        off = off[np.isfinite(off).all(1)]  # between points
        assert len(off) > 0.6 * len(rest) and np.sqrt(np.mean(off**2)) < 3e-5 and np.abs(off).max() < 1.5e-4


def test_impossible_sheets_are_refused():
    with pytest.raises(BadArgument, match='prestretch'):
        SheetMaterial(0.9)


def test_presses_just_far_enough_from_the_clamp_are_used():
    """0.0225 - 0.0165 is a little less than 0.006 in floating point."""
    positions = np.array([(0.024, 0.0165), (0.0, -0.0166), (-0.0241, 0.0), (np.nan, np.nan)])
    assert may_be_pressed(positions, np.array([0.030, 0.0225]), 0.008).tolist() == [True, False, False, False]


PLACE, RADIUS, DEPTHS = np.array([0.008, 0.004]), 7e-3, np.linspace(1e-3, 5e-3, 5)
MESH = SheetMesh(PLACE, np.array([0.030, 0.0225]), 8e-3, 5)


def energy(field, material):
    """Energy over shear modulus times thickness of splines displaced by field (side * side, 3)."""
    edges = np.einsum('egai,eik->egak', MESH.slope, field[MESH.nodes]) + np.eye(2, 3)
    area = np.sum(np.cross(edges[..., 0, :], edges[..., 1, :])**2, axis=-1)
    bent = np.einsum('egi,eik->egk', MESH.laplacian, field[MESH.nodes])
    stored = (np.sum(edges**2, axis=(-2, -1)) + material.prestretch**-6 / area + material.bending * np.sum(bent**2, axis=-1)) / 2
    return float(np.sum(stored * MESH.weight))


def forces(field, material):
    """Force (side, side, 3) of the tip on the inner splines: derivative of the energy."""
    found, h = np.zeros_like(field).reshape(MESH.side, MESH.side, 3), 1e-6
    for i, j, k in np.ndindex(MESH.side - 2, MESH.side - 2, 3):
        step = np.zeros_like(found)
        step[i + 1, j + 1, k] = h
        ahead, behind = (energy(field + sign * step.reshape(-1, 3), material) for sign in (1, -1))
        found[i + 1, j + 1, k] = (ahead - behind) / (2 * h)
    return found


@pytest.mark.parametrize('friction, drag', [(0.0, None), (0.6, None), (0.6, (0.4, -0.2)), (0.6, (0.0, 0.0))])
def test_the_force_of_the_tip_is_in_equilibrium_with_the_sheet(friction, drag):
    material = SheetMaterial(1.05, 2e-7, friction)
    field, wrench = (part[-1] for part in press_sheet(MESH, DEPTHS, RADIUS, material, drag))
    push = forces(field, material)
    assert push.sum(axis=(0, 1)) == pytest.approx(wrench[:3], abs=2e-3 * -wrench[2])
    xi = np.concatenate([[-1], np.arange(-0.9, 1, 0.2), [1]])
    far = np.hypot(xi[:, None], xi) > 0.85  # no point of these splines is under the tip
    assert np.abs(push[far]).max() < 1e-4 * -wrench[2] < -wrench[2]


def test_a_sliding_tip_drags_with_the_given_traction():
    material = SheetMaterial(1.05, 2e-7, 0.0)
    (still, by_still), (slid, by_slid) = (press_sheet(MESH, DEPTHS, RADIUS, material, drag) for drag in ((0.0, 0.0), (0.5, 0.0)))
    straight, by_straight = press_sheet(MESH, DEPTHS, RADIUS, material)
    assert still == pytest.approx(straight, abs=1e-8) and by_still == pytest.approx(by_straight, abs=1e-8)
    more = by_slid[-1, 0] / by_slid[-1, 2] - by_still[-1, 0] / by_still[-1, 2]
    assert -more == pytest.approx(0.5, rel=0.25)  # per normal pressure on a round tip
    assert slid[-1].reshape(MESH.side, MESH.side, 3)[MESH.side // 2, MESH.side // 2, 0] > 1e-4


def test_without_equilibrium_the_result_is_nan():
    fields, wrenches = press_sheet(MESH, np.array([1e-3, np.nan, 2e-3]), RADIUS, SheetMaterial())
    assert np.isfinite(fields[0]).all() and np.isnan(fields[1:]).all() and np.isnan(wrenches[1:]).all()
