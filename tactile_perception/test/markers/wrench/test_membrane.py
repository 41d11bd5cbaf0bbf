# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadCalibration
from tactile_perception.markers.mechanics.membrane_fem import SheetMaterial, press_sheet
from tactile_perception.markers.mechanics.mesh import SheetMesh
from tactile_perception.markers.wrench import membrane as wrench_sheet
from tactile_perception.markers.wrench.membrane import SheetWrench

HALF = np.array([0.030, 0.0225])
DEPTHS = np.linspace(0.0005, 0.006, 12)
RADIUS = 7e-3


def mesh_at(x, y):
    return SheetMesh(np.array([x, y]), HALF, 8e-3, 6)


def energy(mesh, field, material):
    """Of a neo-Hookean membrane that gets thinner as it stretches, and of its bending, per shear modulus times thickness."""
    edges = np.einsum('egai,eik->egak', mesh.slope, field[mesh.nodes]) + np.eye(2, 3)
    area = np.sum(np.cross(edges[..., 0, :], edges[..., 1, :])**2, axis=-1)
    bent = np.einsum('egi,eik->egk', mesh.laplacian, field[mesh.nodes])
    stored = (np.sum(edges**2, axis=(-2, -1)) + material.prestretch**-6 / area + material.bending * np.sum(bent**2, axis=-1)) / 2
    return float(np.sum(stored * mesh.weight))


def test_without_friction_the_force_is_how_energy_grows_with_depth():
    mesh, material = mesh_at(0.010, 0.004), SheetMaterial(1.05, 2e-7, 0.0)
    depths = np.linspace(0.0002, 0.0062, 31)
    fields, wrenches = press_sheet(mesh, depths, RADIUS, material)
    stored = [energy(mesh, field, material) for field in fields]
    force = wrenches[15]
    assert -force[2] == pytest.approx((stored[16] - stored[14]) / (depths[16] - depths[14]), rel=0.005)


def test_a_press_in_the_middle_pushes_straight_down():
    wrench = press_sheet(mesh_at(0, 0), DEPTHS, RADIUS, SheetMaterial())[1][-1]
    assert wrench[2] < 0 and np.abs(wrench[[0, 1]]).max() < 1e-3 * -wrench[2] and np.abs(wrench[3:]).max() < 1e-6 * -wrench[2]


def test_beside_the_middle_the_sheet_pulls_back_and_is_pressed_uphill_of_the_tip():
    wrench = press_sheet(mesh_at(0.015, 0), DEPTHS, RADIUS, SheetMaterial())[1][-1]
    assert 0.1 < wrench[0] / wrench[2] < 0.5            # towards the middle is how the sheet gives way: the tip holds it outside
    assert 1e-4 < -wrench[4] / wrench[2] < 3e-3         # m: the line of force passes towards the near clamp


@pytest.fixture(scope='module')
def table():
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {'NODES': 3, 'DEGREES': (2, 2, 4), 'LEVELS': 6, 'SUBSTEPS': 2, 'SPANS': 5}.items():
            patch.setattr(wrench_sheet, name, value)
        yield SheetWrench.simulate(2 * HALF, np.array([0.019, 0.012]), 0.006, RADIUS, SheetMaterial())


@pytest.mark.full
def test_the_table_tells_what_the_mechanics_do(table):
    for x, y in ((0.004, -0.003), (-0.014, 0.008)):
        for radius in (6.2e-3, 8e-3):
            truth = press_sheet(mesh_at(x, y), DEPTHS, radius, SheetMaterial())[1][[5, 11]]
            told = np.array([table(np.array([x, y]), depth, radius) for depth in DEPTHS[[5, 11]]])
            assert np.abs(told[:, :3] - truth[:, :3]).max(axis=1) == pytest.approx([0, 0], abs=0.03 * np.abs(truth[1, 2]))
            assert told[:, 2] == pytest.approx(truth[:, 2], rel=0.03)


def test_a_tip_that_is_not_known_is_the_calibrated_one(table):
    place = np.array([0.01, 0.005])
    assert table(place, 0.004) == pytest.approx(table(place, 0.004, RADIUS))
    assert table(place, 0.004)[2] > table(place, 0.004, 9e-3)[2]  # a blunter one presses harder


def test_the_table_comes_back_from_its_numbers(table):
    again = SheetWrench.from_numbers(table.numbers())
    assert again(np.array([-0.01, 0.003]), 0.005) == pytest.approx(table(np.array([-0.01, 0.003]), 0.005))


def test_a_sheet_without_balance_is_refused():
    with pytest.MonkeyPatch.context() as patch, pytest.raises(BadCalibration, match='converge'):
        patch.setattr(wrench_sheet, 'press_sheet', lambda mesh, depths, *_: (None, np.full((len(depths), 6), np.nan)))
        SheetWrench.simulate(2 * HALF, HALF / 2, 0.006, RADIUS, SheetMaterial())
