# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import dataclasses

import numpy as np
import pytest
from sheet_reference import appearance, looked_up, read_field
from sheet_scenes import EYE, GRID, MATERIAL, PLAN, library
from tactile_perception.calibration.files.format import CalibrationFile, read_calibration, write_calibration
from tactile_perception.errors import BadCalibration
from tactile_perception.press.sheet import library as module
from tactile_perception.press.sheet.fit import show
from tactile_perception.press.sheet.library import (LibraryPlan, Press, build_library, field_appearance, library_from_numbers,
                                                    library_numbers, pack, unpack)
from tactile_perception.press.sheet.mechanics import SheetMaterial, SheetMesh, press_sheet, uniform


@pytest.mark.parametrize('place, depth, radius', [((0.0, 0.0), 3e-3, 7e-3), ((0.011, -0.006), 5e-3, 8e-3), ((-0.014, 0.009), 2e-3, 6e-3)])
def test_a_press_looked_up_is_one_worked_out(place, depth, radius):
    mesh = SheetMesh(place, PLAN.half, PLAN.scale, PLAN.n)
    solved = press_sheet(mesh, PLAN.load_steps(np.array([depth])), radius, MATERIAL)[0][-1]
    exact = read_field(uniform(solved.reshape(mesh.side, mesh.side, 3)).reshape(-1, 3), PLAN, place, GRID)[:, 0]
    found = show(library(), [Press(np.array(place), depth, np.log(radius / PLAN.radius))], GRID, EYE)[1][:, 0]
    assert np.sqrt(np.mean((found - exact)**2)) < 0.01 * depth and np.abs(found - exact).max() < 0.05 * depth


def test_the_force_on_a_large_sheet_is_told_between_the_simulated_places_too():
    plan = LibraryPlan((0.07, 0.05), 7e-3, 4e-3, n=5, order=4, levels=3, substeps=1)
    material = SheetMaterial(1.05, 3e-7, 0.4)
    large = build_library(plan, material)
    for place in ((0.0, 0.0), (0.04, 0.028), (0.03, 0.0), (-0.05, 0.01)):
        wrench = press_sheet(SheetMesh(place, plan.half, plan.scale, plan.n), plan.depths, plan.radius, material)[1][1]
        told = looked_up(large, Press(np.array(place), plan.depths[1]))[1]
        assert told[0] == pytest.approx(np.log(-wrench[2] / plan.depths[1]), abs=0.012)


@pytest.mark.parametrize('place, depth, drag', [((0.0, 0.0), 4e-3, (0.4, 0.0)), ((0.011, -0.006), 3e-3, (-0.3, 0.2)),
                                                ((0.0, 0.0), 4e-3, (0.9, 0.0)), ((0.004, -0.005), 3e-3, (-0.7, -0.7))])
def test_a_drag_looked_up_is_one_worked_out(place, depth, drag):
    mesh = SheetMesh(place, PLAN.half, PLAN.scale, PLAN.n)
    way = PLAN.load_steps(np.array([depth]))
    field, wrench = (part[-1] for part in press_sheet(mesh, way, PLAN.radius, MATERIAL, drag))
    straight = press_sheet(mesh, way, PLAN.radius, MATERIAL)[1][-1]
    more = wrench[:2] / -wrench[2] - straight[:2] / -straight[2]
    exact = read_field(uniform(field.reshape(mesh.side, mesh.side, 3)).reshape(-1, 3), PLAN, place, GRID)[:, 0]
    press = Press(np.array(place), depth, 0.0, tuple(more))
    found, told = show(library(), [press], GRID, EYE)[1][:, 0], looked_up(library(), press)[1]
    assert np.sqrt(np.mean((found - exact)**2)) < 0.005 * depth and np.abs(found - exact).max() < 0.03 * depth
    assert told[0] == pytest.approx(np.log(-wrench[2] / depth), abs=0.06)
    assert told[1:3] == pytest.approx(wrench[:2] / -wrench[2], abs=0.02)
    assert told[3:6] == pytest.approx(wrench[3:6] / -wrench[2], abs=1e-4)
    assert told[6:] == pytest.approx(wrench[6:], abs=1e-4) and wrench[8] > 5e-5


def test_a_stiff_sheet_is_told_so_well_that_its_place_is_right():
    """What the library lacks, told as a change of place by the derivatives of the field."""
    plan = LibraryPlan((0.0665, 0.0455), 8e-3, 4e-3, 10e-3, n=6, order=4, levels=6, substeps=1)
    material, place, depth, step = SheetMaterial(1.25, 5e-6, 0.35), np.array([0.02, 0.005]), 3e-3, 2e-4
    large = build_library(plan, material)
    x, y = np.meshgrid(np.linspace(-0.061, 0.061, 14), np.linspace(-0.041, 0.041, 11))
    grid = np.column_stack([x.ravel(), y.ravel()])
    eye = np.column_stack([np.where(x > 0, 0.03, -0.03).ravel(), 0 * x.ravel(), np.full(x.size, -0.046)])
    mesh = SheetMesh(place, plan.half, plan.scale, plan.n)
    solved = press_sheet(mesh, plan.load_steps(np.array([depth])), plan.radius, material)[0][-1]
    exact = field_appearance(uniform(solved.reshape(mesh.side, mesh.side, 3)).reshape(-1, 3), plan, place, grid, eye, 0.0)[:, :2]

    def told(*off):
        return show(large, [Press(place + off, depth)], grid, eye)[0][:, :2]

    slopes = np.stack([(told(*move) - told(*-move)).ravel() / (2 * step) for move in step * np.eye(2)], axis=1)
    weight = 1 / (1e-6 + 0.01 * np.repeat(np.hypot(*exact.T), 2))  # model errors are in proportion to the displacement
    lacks = np.linalg.lstsq(slopes * weight[:, None], (exact - told(0.0, 0.0)).ravel() * weight, rcond=None)[0]
    assert np.hypot(*lacks) < 1e-4


def test_mirrored_presses_are_mirrored():
    right, left = (show(library(), [Press(np.array([x, 4e-3]), 4e-3, 0.1, (20 * x, 0.1))], GRID * [100 * x, 1], EYE)[1][:, 0]
                   for x in (0.01, -0.01))
    assert right == pytest.approx(left * [-1, 1, 1], abs=2e-9)


def test_the_way_goes_through_its_stops():
    way = PLAN.load_steps(np.array([1.1e-3, 5e-3]))
    assert {1.1e-3, 5e-3} <= set(way) and (np.diff(way) > 0).all() and np.diff(way).max() < 1e-3 and way[-1] == 5e-3


def test_a_sheet_that_cannot_be_solved_is_refused(monkeypatch):
    monkeypatch.setattr(module, 'press_sheet', lambda mesh, way, *more: (
        np.full((len(way), mesh.side**2, 3), np.nan), np.full((len(way), 9), np.nan)))
    with pytest.raises(BadCalibration, match='converge'):
        build_library(PLAN, MATERIAL)


def test_a_few_that_cannot_be_solved_go_on_in_a_straight_line(monkeypatch):
    plan = dataclasses.replace(PLAN, n=2, levels=8, order=3)

    def ramp(mesh, way, radius, material, drag=None):
        field = np.ones((mesh.side**2, 3)) * way[:, None, None]
        field[(way > 0.99 * plan.depth) & (mesh.place[0] > 0.9 * plan.reach[0]) & (mesh.place[1] > 0.9 * plan.reach[1])] = np.nan
        return field, np.ones((len(way), 9)) * -way[:, None]
    monkeypatch.setattr(module, 'press_sheet', ramp)
    deep = Press(plan.places[:, 0], 0.999999 * plan.depth)
    nodes = looked_up(build_library(plan, MATERIAL), deep)[0].reshape(6, 6, 3)
    assert nodes[1:-1, 1:-1] == pytest.approx(np.full((4, 4, 3), plan.depth), rel=1e-4)


def test_drags_solved_at_one_depth_only_are_told_as_there(monkeypatch):
    plan = dataclasses.replace(PLAN, n=2, levels=8, order=3)

    def ramp(mesh, way, radius, material, drag=None):
        tip = np.append(drag or (0.0, 0.0), -1.0)
        field, wrench = (tip + [0, 0, 2]) * np.ones((mesh.side**2, 1)) * way[:, None, None], np.concatenate([tip, tip, tip]) * way[:, None]
        if drag:
            field[1:], wrench[1:] = np.nan, np.nan
        return field, wrench
    monkeypatch.setattr(module, 'press_sheet', ramp)
    for part in build_library(plan, MATERIAL).classes:
        assert np.isfinite(part.coefficients).all()


def test_what_is_packed_comes_back():
    values = np.random.default_rng(0).normal(size=(7, 11, 3))
    values[3] *= 1e-6
    values[4] = 0
    again = unpack(pack(values), (11, 3))
    for value, found in zip(values, again):
        np.testing.assert_allclose(found, value, rtol=0, atol=np.abs(value).max() / 60000)


def test_the_library_survives_a_calibration_file(tmp_path):
    write_calibration(tmp_path / 'file.yaml', CalibrationFile('areal_single', {}, library_numbers(library()), {}, {}))
    again = library_from_numbers(read_calibration(tmp_path / 'file.yaml', 'areal_single').fitted, MATERIAL)
    press = Press(np.array([0.01, -0.004]), 5e-3, 0.1, (0.3, 0.1))
    fields = [show(one, [press], GRID, EYE)[1][:, 0] for one in (library(), again)]
    assert np.abs(fields[1] - fields[0]).max() < 5e-6
    assert again.plan == library().plan


@pytest.mark.parametrize('broken', [{}, {'half': [0.03, 0.02]}, {'classes': [{}]}])
def test_what_is_no_library_is_refused(broken):
    with pytest.raises(BadCalibration, match='calibrate again'):
        library_from_numbers(broken, MATERIAL)


def test_a_library_of_other_places_is_refused():
    numbers = library_numbers(library())
    numbers['places'] = (PLAN.reach[:, None] * PLAN.nodes).tolist()
    with pytest.raises(BadCalibration, match='other places; run calibrate again'):
        library_from_numbers(numbers, MATERIAL)


@pytest.mark.parametrize('part', ['shapes', 'coefficients'])
def test_a_shortened_array_is_refused(part):
    numbers = library_numbers(library())
    numbers['classes'][0][part]['digits'] = numbers['classes'][0][part]['digits'][:2]
    with pytest.raises(BadCalibration, match='calibrate again'):
        library_from_numbers(numbers, MATERIAL)


def test_a_sheet_that_comes_nearer_as_a_whole_looks_larger():
    field = np.zeros(((2 * PLAN.n + 2)**2, 3))
    field[:, 2] = -0.002
    seen, deformed = field_appearance(field, PLAN, (0.0, 0.0), GRID, EYE, 1e-6), np.zeros((len(GRID), 3, 3))
    deformed[:, 0, 2] = -0.002
    assert seen == pytest.approx(appearance(deformed, GRID, EYE), abs=1e-6)
    assert seen[:, :2] == pytest.approx(GRID * (0.062 / 0.060 - 1), abs=1e-7)
