# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Equilibria of the kernel against the energy of the sheet: its derivative is the force of the tip, and lies within friction's cone."""
import numpy as np
import pytest
from tactile_perception.press.sheet.membrane_fem import SheetMaterial, press_sheet
from tactile_perception.press.sheet.mesh import SheetMesh

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
