# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import dataclasses

import numpy as np
import pytest
from sheet_scenes import field_of, pressed
from tactile_perception.errors import BadCalibration
from tactile_perception.press.sheet.calibration import fit_numbers
from tactile_perception.press.sheet.mechanics import SheetMaterial
from tactile_perception.press.sheet.library import LibraryPlan
from tactile_perception.press.sheet.model import CameraShifts
from tactile_perception.press.presses import Presses
from tactile_perception.press.field import MarkerField


def test_markers_get_the_shift_of_their_camera_centre_and_the_place_and_turn_of_the_print():
    centres = np.array([[-0.03, 0, -0.05], [-0.0301, 0, -0.05], [0.03, 0, -0.05], [np.nan] * 3])
    rest, shift, unknown = np.array([[1e-2, 0.0], [0.0, 1e-2]] * 2), np.tile([0.0, 1e-3], (4, 1)), np.zeros(4)
    field = MarkerField(rest, shift, unknown, centres, unknown, 0 * rest, 0 * rest, unknown)
    known = CameraShifts.of(field)
    assert len(known.camera_centres) == 2
    moved = dataclasses.replace(known, shifts=np.array([[1e-4, 0], [0, 2e-4]]), printed=np.array([2e-4, -1e-4]), turned=0.1).shifted(field)
    turn = np.array([[np.cos(0.1), np.sin(0.1)], [-np.sin(0.1), np.cos(0.1)]])
    at = centres[:3, :2] + [[1e-4, 0], [1e-4, 0], [0, 2e-4]]
    assert moved.camera_centre[:3, :2] == pytest.approx(at @ turn + [2e-4, -1e-4]) and np.isnan(moved.camera_centre[3]).all()
    assert moved.rest == pytest.approx(rest @ turn + [2e-4, -1e-4]) and moved.shift == pytest.approx(shift @ turn)


PLAN = LibraryPlan((0.030, 0.0225), 7.5e-3, 7e-3, n=5, levels=5, substeps=2)
PLACES = [(0.0, 0.0), (0.014, 0.009), (-0.014, 0.009), (0.002, -0.010)]


def presses(radius=6e-3, material=SheetMaterial(1.045, 3e-7, 0.4), depths=(6e-3, 3e-3), places=PLACES):
    at = [(*place, depth) for place in places for depth in depths]
    fields = tuple(field_of(pressed(*where, radius, material), 1e-6, 1e-3, seed) for seed, where in enumerate(at))
    at = np.array(at)
    return Presses(fields, at * [1, 1, -1], at[:, 2])


@pytest.mark.full
def test_the_numbers_of_another_sheet_and_tip_are_found():
    numbers = fit_numbers(presses(places=PLACES[:2]), PLAN)
    assert numbers.radius == pytest.approx(6e-3, rel=0.05)
    assert numbers.material.prestretch - 1 == pytest.approx(0.045, rel=0.12)
    assert numbers.material.friction == pytest.approx(0.4, rel=0.2)
    assert np.abs(numbers.camera_centres.shifts).max() < 1e-4


@pytest.mark.full
def test_a_print_off_its_nominal_place_is_found():
    """Without, the camera centres and friction would have to explain it."""
    true, off = presses(places=PLACES[:3]), np.array([2.5e-4, -2e-4, 0.0])
    numbers = fit_numbers(dataclasses.replace(true, position=true.position + off), PLAN)
    assert numbers.camera_centres.printed == pytest.approx(off[:2], abs=1e-4) and np.abs(numbers.camera_centres.shifts).max() < 1.5e-4
    assert numbers.material.friction == pytest.approx(0.4, rel=0.3)


def test_presses_at_the_clamp_alone_are_refused():
    with pytest.raises(BadCalibration, match='farther from the clamp'):
        fit_numbers(presses(places=[(0.022, 0.0)]).select(np.array([True, False])), LibraryPlan((0.026, 0.0225), 7.5e-3, 7e-3))
