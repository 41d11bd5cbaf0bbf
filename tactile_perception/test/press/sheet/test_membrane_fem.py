# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import os
from pathlib import Path

import numpy as np
import pytest
from sheet_reference import read_field
from tactile_perception.errors import BadArgument
from tactile_perception.press.sheet.membrane_fem import SheetMaterial, press_sheet
from tactile_perception.press.sheet.mesh import SheetMesh, uniform
from tactile_perception.press.sheet.reduced_model import LibraryPlan

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
