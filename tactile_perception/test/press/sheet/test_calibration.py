# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import dataclasses

import numpy as np
import pytest
from sheet_scenes import field_of, pressed
from tactile_perception.errors import BadCalibration
from tactile_perception.press.sheet.calibration import CameraShifts, chosen_places, fit_numbers
from tactile_perception.press.sheet.mechanics import SheetMaterial
from tactile_perception.press.sheet.library import LibraryPlan
from tactile_perception.press.presses import Presses
from tactile_perception.press.field import MarkerField


def test_each_marker_gets_the_shift_of_its_own_camera_centre():
    camera_centre = np.array([[-0.03, 0, -0.05], [-0.0301, 0, -0.05], [0.03, 0, -0.05], [np.nan] * 3])
    nothing = np.zeros((4, 2))
    field = MarkerField(nothing, nothing, np.zeros(4), camera_centre, np.zeros(4), nothing, nothing, np.zeros(4))
    camera_centres = CameraShifts.of(field)
    assert len(camera_centres.camera_centres) == 2
    shifted = CameraShifts(camera_centres.camera_centres, np.array([[1e-4, 0], [0, 2e-4]])).shifted(field)
    assert shifted.camera_centre[:3] - camera_centre[:3] == pytest.approx(np.array([[1e-4, 0, 0], [1e-4, 0, 0], [0, 2e-4, 0]]))
    assert np.isnan(shifted.camera_centre[3]).all()


def test_a_print_off_its_nominal_place_moves_markers_and_camera_centres_alike():
    camera_centre, rest = np.array([[0.0, 0, -0.05]] * 3), np.arange(6.0).reshape(3, 2)
    field = MarkerField(rest, 0 * rest, np.zeros(3), camera_centre, np.zeros(3), 0 * rest, 0 * rest, np.zeros(3))
    moved = CameraShifts(camera_centre[:1], np.zeros((1, 2)), np.array([2e-4, -1e-4])).shifted(field)
    assert moved.rest - rest == pytest.approx(np.tile([2e-4, -1e-4], (3, 1))) and moved.camera_centre - camera_centre == pytest.approx(
        np.tile([2e-4, -1e-4, 0], (3, 1)))


def test_a_turned_print_turns_markers_and_their_shifts():
    rest, shift = np.array([[1e-2, 0.0], [0.0, 1e-2]]), np.array([[0.0, 1e-3], [0.0, 1e-3]])
    camera_centre = np.array([[2e-3, 0, -0.05]] * 2)
    field = MarkerField(rest, shift, np.zeros(2), camera_centre, np.zeros(2), 0 * rest, 0 * rest, np.zeros(2))
    turned = CameraShifts(camera_centre[:1], np.zeros((1, 2)), turned=0.1).shifted(field)
    c, s = np.cos(0.1), np.sin(0.1)
    assert turned.rest == pytest.approx(1e-2 * np.array([[c, s], [-s, c]]))
    assert turned.shift == pytest.approx(1e-3 * np.array([[-s, c]] * 2))
    assert turned.camera_centre == pytest.approx(np.array([[2e-3 * c, 2e-3 * s, -0.05]] * 2))


PLAN = LibraryPlan((0.030, 0.0225), 7.5e-3, 7e-3, n=5, levels=5, substeps=2)
PLACES = [(0.0, 0.0), (0.014, 0.009), (-0.014, 0.009), (0.002, -0.010)]


def presses(radius=6e-3, material=SheetMaterial(1.045, 3e-7, 0.4), depths=(6e-3, 3e-3), places=PLACES):
    at = [(*place, depth) for place in places for depth in depths]
    fields = tuple(field_of(pressed(*where, radius, material), 1e-6, 1e-3, seed) for seed, where in enumerate(at))
    count, at = len(at), np.array(at)
    return Presses(fields, at * [1, 1, -1], at[:, 2], np.arange(count), np.full((count, 6), np.nan), np.full(count, np.nan))


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


@pytest.mark.full
def test_places_are_far_apart_on_the_folded_sheet_and_depths_rise():
    groups = chosen_places(presses(), PLAN)
    assert [tuple(group.position[0, :2]) for group in groups[:2]] == [(0.0, 0.0), (0.014, 0.009)]
    assert len(groups) == 3  # the mirror image of the second adds nothing
    assert all((np.diff(group.depth) > 0).all() for group in groups)


def test_presses_at_the_clamp_alone_are_refused():
    with pytest.raises(BadCalibration, match='farther from the clamp'):
        chosen_places(presses(places=[(0.022, 0.0)]).select(np.array([True, False])), LibraryPlan((0.026, 0.0225), 7.5e-3, 7e-3))
