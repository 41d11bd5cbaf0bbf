# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import dataclasses
import math

import numpy as np
import pytest
import yaml
from sheet_scenes import GRID, MATERIAL, PLAN, library
from tactile_perception.calibration.files.format import check_numbers
from tactile_perception.errors import BadCalibration
from tactile_perception.markers.mechanics import reduced_model
from tactile_perception.markers.mechanics.membrane_fem import press_sheet
from tactile_perception.markers.mechanics.mesh import SheetMesh, uniform
from tactile_perception.markers.mechanics.projection import read_field
from tactile_perception.markers.mechanics.reduced_model import build_library, library_from_numbers, library_numbers, pack, unpack


@pytest.mark.parametrize('place, depth, radius', [((0.0, 0.0), 3e-3, 7e-3), ((0.011, -0.006), 5e-3, 8e-3), ((-0.014, 0.009), 2e-3, 6e-3)])
def test_a_press_looked_up_is_one_worked_out(place, depth, radius):
    mesh = SheetMesh(place, PLAN.half, PLAN.scale, PLAN.n)
    solved = press_sheet(mesh, PLAN.load_steps(np.array([depth])), radius, MATERIAL)[0][-1]
    exact = read_field(uniform(solved.reshape(mesh.side, mesh.side, 3)).reshape(-1, 3), PLAN, place, GRID)[:, 0]
    found = read_field(library().fields(place, depth, np.log(radius / PLAN.radius))[:, 0], PLAN, place, GRID)[:, 0]
    assert np.sqrt(np.mean((found - exact)**2)) < 0.01 * depth and np.abs(found - exact).max() < 0.05 * depth


def test_mirrored_presses_are_mirrored():
    right, left = (read_field(library().fields((x, 4e-3), 4e-3, 0.1)[:, 0], PLAN, (x, 4e-3), GRID * [100 * x, 1])[:, 0]
                   for x in (0.01, -0.01))
    assert right == pytest.approx(left * [-1, 1, 1], abs=1e-9)


@pytest.mark.parametrize('k, step', [(0, 1e-4), (1, 1e-4), (2, 5e-5), (3, 1e-2)])
def test_fields_tell_their_derivatives(k, step):
    at, way = np.array([0.011, -0.006, 4e-3, 0.08]), np.eye(4)[k] * step
    ahead, behind = (library().fields(vector[:2], *vector[2:])[:, 0] for vector in (at + way, at - way))
    found = library().fields(at[:2], *at[2:])[:, 1 + k]
    assert found == pytest.approx((ahead - behind) / (2 * step), abs=2e-3 * np.abs(found).max())


def test_no_depth_is_no_field():
    assert np.abs(library().fields((0.003, 0.002), 0.0, 0.0)[:, 0]).max() < 1e-5


def test_the_way_goes_through_its_stops():
    way = PLAN.load_steps(np.array([1.1e-3, 5e-3]))
    assert {1.1e-3, 5e-3} <= set(way) and (np.diff(way) > 0).all() and np.diff(way).max() < 1e-3 and way[-1] == 5e-3


def test_a_sheet_that_cannot_be_solved_is_refused(monkeypatch):
    monkeypatch.setattr(reduced_model, 'press_sheet', lambda mesh, way, *more: (np.full((len(way), mesh.side**2, 3), np.nan), None))
    with pytest.raises(BadCalibration, match='converge'):
        build_library(PLAN, MATERIAL)


def test_a_few_that_cannot_be_solved_go_on_in_a_straight_line(monkeypatch):
    plan = dataclasses.replace(PLAN, n=2, levels=8, order=3)

    def ramp(mesh, way, radius, material):
        field = np.ones((mesh.side**2, 3)) * way[:, None, None]
        field[(way > 0.99 * plan.depth) & (mesh.place[0] > 0.9 * plan.reach[0]) & (mesh.place[1] > 0.9 * plan.reach[1])] = np.nan
        return field, None
    monkeypatch.setattr(reduced_model, 'press_sheet', ramp)
    nodes = build_library(plan, MATERIAL).fields(plan.reach * plan.nodes[0], plan.depth, 0.0)[:, 0].reshape(6, 6, 3)
    assert nodes[1:-1, 1:-1] == pytest.approx(np.full((4, 4, 3), plan.depth), rel=1e-6)


def test_what_is_packed_comes_back():
    values = np.random.default_rng(0).normal(size=(7, 11, 3))
    packed = pack(values)
    assert unpack(packed, values.shape) == pytest.approx(values, abs=np.abs(values).max() / 60000)
    assert all(math.isfinite(number) for number in packed['digits'])


def test_the_library_survives_a_calibration_file():
    numbers = yaml.safe_load(yaml.safe_dump(library_numbers(library())))
    check_numbers(numbers, 'fitted', 'file')
    again = library_from_numbers(numbers)
    fields = [one.fields(np.array([0.01, -0.004]), 5e-3, 0.1) for one in (library(), again)]
    assert np.abs(fields[1] - fields[0])[:, 0].max() < 5e-6
    assert again.plan == library().plan


@pytest.mark.parametrize('broken', [{}, {'half': [0.03, 0.02]}, {'classes': [{}]}])
def test_what_is_no_library_is_refused(broken):
    with pytest.raises(BadCalibration, match='calibrate again'):
        library_from_numbers(broken)


def test_a_shortened_number_is_refused():
    numbers = library_numbers(library())
    numbers['classes'][0]['shapes']['digits'] = numbers['classes'][0]['shapes']['digits'][:2]
    with pytest.raises(BadCalibration, match='calibrate again'):
        library_from_numbers(numbers)
