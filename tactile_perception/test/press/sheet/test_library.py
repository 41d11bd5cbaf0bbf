# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import dataclasses

import numpy as np
import pytest
from sheet_scenes import EYE, GRID, MATERIAL, PLAN, library
from tactile_perception.calibration.files.format import CalibrationFile, read_calibration, write_calibration
from tactile_perception.errors import BadCalibration
from tactile_perception.press.sheet import library as module
from tactile_perception.press.sheet.model import show
from tactile_perception.press.sheet.library import Press, SheetLibrary, build_library, field_appearance
from tactile_perception.press.sheet.mechanics import SheetMesh, press_sheet, uniform
from tactile_perception.press.calibration import restored, stored


@pytest.mark.parametrize('place, depth, radius, drag', [
    ((0.0, 0.0), 3e-3, 7e-3, None), ((0.011, -0.006), 5e-3, 8e-3, None), ((-0.014, 0.009), 2e-3, 6e-3, None),
    ((0.0, 0.0), 4e-3, 7e-3, (0.9, 0.0)), ((0.011, -0.006), 3e-3, 7e-3, (-0.3, 0.2)), ((0.004, -0.005), 3e-3, 7e-3, (-0.7, -0.7))])
def test_a_press_looked_up_is_one_worked_out(place, depth, radius, drag):
    mesh, way = SheetMesh(place, PLAN.half, PLAN.scale, PLAN.n), PLAN.load_steps(np.array([depth]))
    (field, wrench), (_, straight) = ([part[-1] for part in press_sheet(mesh, way, radius, MATERIAL, how)] for how in (drag, None))
    exact = field_appearance(uniform(field.reshape(mesh.side, mesh.side, 3)).reshape(-1, 3), PLAN, place, GRID, EYE, 0.0)[:, :2]
    more = wrench[:2] / -wrench[2] - straight[:2] / -straight[2]
    found = show(library(), [Press(np.array(place), depth, np.log(radius / PLAN.radius), tuple(more))], GRID, EYE)[0][:, :2]
    assert np.sqrt(np.mean((found - exact)**2)) < 0.01 * depth and np.abs(found - exact).max() < 0.05 * depth


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
    moved = show(build_library(plan, MATERIAL), [deep], deep.place[None], EYE[:1])[1][0, 0]
    assert moved == pytest.approx(np.full(3, plan.depth), rel=1e-3)


def test_the_library_survives_a_calibration_file(tmp_path):
    write_calibration(tmp_path / 'file.yaml', CalibrationFile('areal_single', {}, stored(library()), {}, {}))
    again = restored(SheetLibrary, read_calibration(tmp_path / 'file.yaml', 'areal_single').fitted)
    press = Press(np.array([0.01, -0.004]), 5e-3, 0.1, (0.3, 0.1))
    fields = [show(one, [press], GRID, EYE)[1][:, 0] for one in (library(), again)]
    assert np.abs(fields[1] - fields[0]).max() < 5e-6
    assert again.plan == library().plan
