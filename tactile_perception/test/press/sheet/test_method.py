# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sheet model: method, calibration and library."""
import dataclasses
import functools

import numpy as np
import pytest
from sheet_scenes import EYE, GRID, MATERIAL, PLAN, SENSOR, field_of, library, pressed

from tactile_perception.core.calibration_file import CalibrationFile, read_calibration, write_calibration
from tactile_perception.core.errors import BadCalibration
from tactile_perception.press.calibration import restored, stored
from tactile_perception.press.estimate import AMBIGUOUS, OUT_OF_RANGE
from tactile_perception.press.presses import Presses
from tactile_perception.press.sheet import library as module
from tactile_perception.press.sheet.calibration import calibrate_sheet, fit_numbers
from tactile_perception.press.sheet.library import LibraryPlan, Press, SheetLibrary, build_library, field_appearance
from tactile_perception.press.sheet.mechanics import SheetMaterial, SheetMesh, press_sheet, uniform
from tactile_perception.press.sheet.model import (
    CameraShifts,
    FieldNoise,
    Seen,
    SheetCalibration,
    SheetInverse,
    SheetModelMethod,
    show,
)

NOISE = FieldNoise(5e-6, 5e-3, 3e-3, 1.5)
COVERED = np.array([[-0.018, -0.011], [0.018, 0.011]])


@functools.cache
def fitted():
    return SheetCalibration(library(), 1.2e-3, CameraShifts(np.array([[0, 0, -0.062]]), np.zeros((1, 2))), NOISE, 3e-5, 0.01,
                            COVERED, 6e-3)


@functools.cache
def common_method():
    return SheetModelMethod(fitted(), SENSOR)


UNTOUCHED = field_of(np.zeros((len(GRID), 3)), 5e-6, 5e-3)


def begun(field):
    """Contacts in the first frame of a contact."""
    assert common_method().estimate(UNTOUCHED) == []
    return common_method().estimate(field)


def touches(*press, noise=5e-6, growth=5e-3, seed=0):
    return begun(field_of(pressed(*press), noise, growth, seed))


def together(presses, mixed=0.2, seed=0):
    """Contacts of presses whose fields do not add up exactly where they overlap."""
    return begun(field_of(show(library(), presses, GRID, EYE, mixed)[0], 2e-6, 2e-3, seed))


@pytest.mark.parametrize('one, other', [((-0.010, 0.003, 3e-3), (0.006, -0.004, 2.4e-3)), ((-0.008, -0.006, 4e-3), (0.004, 0.005, 3.5e-3)),
                                        ((0.0, 0.0, 2e-3), (0.012, 0.002, 2e-3)), ((-0.008, 0.0, 3e-3), (0.008, 0.0, 3e-3))])
def test_two_presses_are_separated_at_the_centres_of_their_contacts(one, other):
    found = together([Press(np.array(press[:2]), press[2]) for press in (one, other)])
    assert len(found) == 2 and np.isnan([touch.wrench for touch in found]).all()
    for touch, press in zip(sorted(found, key=lambda touch: touch.position[0]), (one, other)):
        assert np.abs(touch.position[:2] - press[:2]).max() < 8e-4
        assert touch.depth > press[2] and touch.depth + touch.position[2] > 0, 'above the lowest point'


@pytest.mark.parametrize('radius, depth', [(21e-3, 6e-3), (28e-3, 5e-3)])
def test_two_tips_beyond_the_model_are_two_with_a_larger_covariance(radius, depth):
    truth = [(-0.013, 0.002, 3e-3, PLAN.radius), (0.013, -0.003, depth, radius)]
    found = begun(field_of(sum(pressed(*press) for press in truth), 5e-6, 5e-3))
    assert len(found) == 2
    for touch, press in zip(sorted(found, key=lambda touch: touch.position[0]), truth):
        off = touch.position[:2] - press[:2]
        assert np.hypot(*off) < 3e-3 and off @ np.linalg.solve(touch.covariance[:2, :2], off) / 2 < 3


@pytest.mark.parametrize('position', [(0.0, 0.0), (0.012, -0.007), (-0.015, 0.010), (0.003, 0.0145)])
def test_one_tip_of_any_size_is_one_contact(position):
    for depth, radius in ((1e-3, 7e-3), (4e-3, 5.6e-3), (4e-3, 8.75e-3)):
        for seed in range(4):
            touch, = touches(*position, depth, radius, seed=seed)
            assert np.hypot(*(touch.position[:2] - position)) < 8e-4


def test_a_drag_is_distinguished_from_a_press_elsewhere_and_from_two():
    touch, = together([Press(np.array([0.005, -0.003]), 4e-3, drag=(0.4, -0.25))])
    assert np.abs(touch.position - [0.005, -0.003, -4e-3]).max() < 2e-4
    straight, = together([Press(np.array([0.005, -0.003]), 4e-3)])
    assert (touch.wrench / touch.wrench[2] - straight.wrench / straight.wrench[2])[:2] == pytest.approx([-0.4, 0.25], abs=0.03)


def test_a_second_press_is_reported_once_it_exceeds_the_noise():
    one = Press(np.array([-0.008, 0.0]), 4e-3)
    reported = [len(together([one] + ([Press(np.array([0.010, 0.004]), 1.5e-4 * k)] if k else []), seed=k)) for k in range(25)]
    assert reported[0] == 1 and reported[-8:] == [2] * 8


def test_a_contact_is_reported_with_its_uncertainty():
    touch, = touches(0.012, -0.007, 4e-3, 8e-3)
    assert touch.position == pytest.approx([0.012, -0.007, -4e-3], abs=1.5e-4) and touch.depth == -touch.position[2]
    assert touch.radius == pytest.approx(8e-3, rel=0.25) and touch.flags == 0
    assert 3e-5 < np.sqrt(touch.covariance[0, 0]) < 3e-4 and touch.depth_sigma == pytest.approx(np.sqrt(touch.covariance[2, 2]))
    assert np.linalg.eigvalsh(touch.covariance).min() > 0


def test_the_covariance_of_a_press_covers_other_frictions():
    squares = []
    for friction in (0.2, 0.8):
        for position, depth, radius in (((0.0, 0.0), 3e-3, 7e-3), ((0.010, -0.006), 5e-3, 8e-3), ((-0.012, 0.005), 4e-3, 6e-3)):
            touch, = touches(*position, depth, radius, dataclasses.replace(MATERIAL, friction=friction))
            squares.append((touch.depth - depth)**2 / touch.depth_sigma**2)
    assert 0.1 < np.mean(squares) < 2


def test_positions_are_reported_in_the_frame_of_the_sheet():
    shift, turn = np.array([3e-4, -2e-4]), 5e-3
    aside = dataclasses.replace(fitted(), camera_centres=dataclasses.replace(fitted().camera_centres, printed=shift, turned=turn))
    field = field_of(pressed(0.004, -0.003, 3e-3))
    (there,), (here,) = (SheetModelMethod(one, SENSOR).estimate(field) for one in (aside, fitted()))
    x, y = here.position[:2]
    # the clamp does not move with the print
    assert there.position - here.position == pytest.approx([shift[0] - turn * y, shift[1] + turn * x, 0], abs=8e-5)


def test_a_late_second_camera_causes_a_small_error():
    """Two cameras, each over its half; the right one exposes late, after 15 % of the motion between frames, which is unknown."""
    right = GRID[:, :1] > 0.0
    camera_centres = np.where(right, [0.015, 0.0, -0.062], [-0.015, 0.0, -0.062])
    calibration = dataclasses.replace(fitted(), camera_centres=CameraShifts(np.unique(camera_centres, axis=0), np.zeros((2, 2))))
    method, errors = SheetModelMethod(calibration, SENSOR), []
    for k in range(6):
        left, late = (show(library(), [Press(np.array([-0.006 + 0.003 * (k + share), 0.004]), 3e-3)], GRID,
                           camera_centres)[0] for share in (0, 0.15))
        field = dataclasses.replace(field_of(np.where(right, late, left), 1e-6, 1e-3, k), camera_centre=camera_centres)
        reported = [each.estimate(field)[0].position[0] for each in (method, SheetModelMethod(calibration, SENSOR))]
        errors.append(np.abs(np.array(reported) - (-0.006 + 0.003 * k)))
    following, each_alone = np.mean(errors[1:], axis=0)
    assert following < 0.6 * each_alone and errors[0][0] == errors[0][1]


def test_shallow_contacts_are_reported():
    touch, = touches(-0.006, 0.004, 3e-4)
    off = touch.position - [-0.006, 0.004, -3e-4]
    assert np.hypot(*off[:2]) < 2e-3 and abs(off[2]) < 5e-5 and off @ np.linalg.solve(touch.covariance, off) < 20


def test_noise_causes_no_contact():
    still = np.zeros((len(GRID), 3))
    assert not any(common_method().estimate(field_of(still, 5e-6, 5e-3, seed)) for seed in range(300))


def test_presses_outside_the_calibrated_range_are_flagged():
    deep, = touches(0.0, 0.0, 7e-3)
    outside, = touches(0.0, 0.0158, 3e-3)
    assert deep.flags & OUT_OF_RANGE and outside.flags & OUT_OF_RANGE


def test_a_contact_without_visible_markers_is_not_reported():
    seen, right = field_of(pressed(0.012, 0.0, 3e-3), 5e-6, 5e-3), GRID[:, 0] > -0.002
    assert len(common_method().estimate(seen)) == 1
    half = dataclasses.replace(seen, shift=np.where(right[:, None], np.nan, seen.shift))
    assert all(np.abs(found.position[0] + 0.002) < 0.012 for found in common_method().estimate(half))


def test_an_unexplained_first_frame_of_two_cameras_is_skipped():
    camera_centres, shift = CameraShifts(np.array([[-0.03, 0, -0.062], [0.03, 0, -0.062]]), np.zeros((2, 2))), pressed(0.010, 0.0, 4e-3)
    method = SheetModelMethod(dataclasses.replace(fitted(), camera_centres=camera_centres), SENSOR)
    torn = field_of(np.where(GRID[:, :1] > 0.006, 0.2 * shift, shift), 5e-6, 5e-3)  # the right camera is far behind
    assert method.estimate(field_of(0 * shift, 5e-6, 5e-3)) == [] and method.estimate(torn) == []
    assert all(touch.flags & AMBIGUOUS for touch in method.estimate(torn)) and len(method.estimate(torn)) > 0
    assert common_method().estimate(torn)[0].flags & AMBIGUOUS, 'one camera sees all at once'


@pytest.mark.full
def test_shift_and_rotation_of_the_print_are_identified_from_all_presses():
    at = np.array([(x, y, depth) for x in (-0.012, 0.0, 0.011) for y in (-0.006, 0.007) for depth in (3e-3, 5e-3)])
    fields = tuple(field_of(pressed(*where), 5e-6, 5e-3, seed) for seed, where in enumerate(at))
    shift, turn = np.array([3e-4, -2e-4]), 8e-3
    position = np.column_stack([at[:, 0] - turn * at[:, 1] + shift[0], at[:, 1] + turn * at[:, 0] + shift[1], -at[:, 2]])
    presses = Presses(fields, position, at[:, 2])
    camera_centres = calibrate_sheet(presses, SENSOR, fitted()).camera_centres
    assert camera_centres.printed == pytest.approx(shift, abs=5e-5) and camera_centres.turned == pytest.approx(turn, abs=2e-3)


def test_the_wrench_is_that_of_the_simulation():
    touch, = touches(0.010, -0.006, 4e-3)
    wrench = press_sheet(SheetMesh((0.010, -0.006), PLAN.half, PLAN.scale, 8), np.linspace(2e-4, 4e-3, 20), 7e-3, MATERIAL)[1][-1]
    exact = np.append(wrench[:3], np.cross([0.010, -0.006, -4e-3], wrench[:3]) + wrench[3:6])
    assert touch.wrench[:3] == pytest.approx(exact[:3], abs=-0.03 * exact[2]) and touch.wrench[2] == pytest.approx(exact[2], rel=0.03)
    assert touch.wrench[3:] == pytest.approx(exact[3:], abs=0.04 * np.abs(exact[3:]).max())


def test_equal_frames_give_equal_results_and_a_pause_resets_the_state():
    press = [field_of(pressed(0.012, -0.007, 4e-3, 8e-3), 5e-6, 5e-3, seed) for seed in range(3)]
    still = field_of(np.zeros((len(GRID), 3)), 5e-6, 5e-3)
    reported = [[touch.position.tolist() for field in press for touch in SheetModelMethod(fitted(), SENSOR).estimate(field)]]
    for _ in range(2):
        method = SheetModelMethod(fitted(), SENSOR)
        reported.append([touch.position.tolist() for field in [press[0], still, press[1], still,
                                                               press[2]] for touch in method.estimate(field)])
    assert reported[0] == reported[1] == reported[2] and len(reported[0]) == 3


def test_the_covariance_is_that_of_many_trials():
    """On fields of the library itself, only noise scatters the estimates, as stated."""
    inverse, press = SheetInverse(library(), FieldNoise(1e-5, 5e-3, 1e-6, 1e-4), 0.0, 4.5e-3), Press(np.array([0.008, 0.004]), 3e-3)
    field = field_of(np.zeros((117, 3)))
    clean, _ = show(library(), [press], field.rest, field.camera_centre)
    errors, inverses = [], []
    for seed in range(150):
        found = inverse.solve(Seen(field_of(clean, 1e-5, 5e-3, seed)), [press])
        errors.append(found.presses[0].vector - press.vector)
        inverses.append(np.linalg.inv(found.covariance[:3, :3]))
    squares = [error[:3] @ inverse @ error[:3] / 3 for error, inverse in zip(errors, inverses)]
    assert 0.7 < np.mean(squares) < 1.3


def test_noise_above_the_calibrated_one_causes_no_contact():
    """It does not hide a press either."""
    noise = dataclasses.replace(NOISE, shift=1e-5, growth=5e-3)
    method, still = SheetModelMethod(dataclasses.replace(fitted(), noise=noise), SENSOR), np.zeros((len(GRID), 3))
    scores = [method.score(field_of(still, 3e-5, 2e-2, seed)) for seed in range(300)]
    assert max(scores) < 6 < 30 < method.score(field_of(pressed(0.006, -0.004, 3e-3), 3e-5, 2e-2))


PRINTED = LibraryPlan((0.030, 0.0225), 7.5e-3, 7e-3, n=5, levels=5, substeps=2)
POSITIONS = [(0.0, 0.0), (0.014, 0.009), (-0.014, 0.009), (0.002, -0.010)]


def presses(radius=6e-3, material=SheetMaterial(1.045, 3e-7, 0.4), depths=(6e-3, 3e-3), positions=POSITIONS):
    at = [(*position, depth) for position in positions for depth in depths]
    fields = tuple(field_of(pressed(*where, radius, material), 1e-6, 1e-3, seed) for seed, where in enumerate(at))
    at = np.array(at)
    return Presses(fields, at * [1, 1, -1], at[:, 2])


@pytest.mark.full
def test_the_numbers_of_another_sheet_and_tip_are_identified():
    numbers = fit_numbers(presses(positions=POSITIONS[:2]), PRINTED)
    assert numbers.radius == pytest.approx(6e-3, rel=0.05)
    assert numbers.material.prestretch - 1 == pytest.approx(0.045, rel=0.12)
    assert numbers.material.friction == pytest.approx(0.4, rel=0.2)
    assert np.abs(numbers.camera_centres.shifts).max() < 1e-4


def test_presses_at_the_clamp_alone_are_refused():
    with pytest.raises(BadCalibration, match='farther from the clamp'):
        fit_numbers(presses(positions=[(0.022, 0.0)]).select(np.array([True, False])), LibraryPlan((0.026, 0.0225), 7.5e-3, 7e-3))


@pytest.mark.parametrize('position, depth, radius, drag', [
    ((0.0, 0.0), 3e-3, 7e-3, None), ((0.011, -0.006), 5e-3, 8e-3, None), ((-0.014, 0.009), 2e-3, 6e-3, None),
    ((0.0, 0.0), 4e-3, 7e-3, (0.9, 0.0)), ((0.011, -0.006), 3e-3, 7e-3, (-0.3, 0.2)), ((0.004, -0.005), 3e-3, 7e-3, (-0.7, -0.7))])
def test_a_press_from_the_library_equals_a_simulated_one(position, depth, radius, drag):
    mesh, steps = SheetMesh(position, PLAN.half, PLAN.scale, PLAN.n), PLAN.load_steps(np.array([depth]))
    (field, wrench), (_, straight) = ([part[-1] for part in press_sheet(mesh, steps, radius, MATERIAL, how)] for how in (drag, None))
    exact = field_appearance(uniform(field.reshape(mesh.side, mesh.side, 3)).reshape(-1, 3), PLAN, position, GRID, EYE, 0.0)[:, :2]
    more = wrench[:2] / -wrench[2] - straight[:2] / -straight[2]
    found = show(library(), [Press(np.array(position), depth, np.log(radius / PLAN.radius), tuple(more))], GRID, EYE)[0][:, :2]
    assert np.sqrt(np.mean((found - exact)**2)) < 0.01 * depth and np.abs(found - exact).max() < 0.05 * depth


def test_a_sheet_that_cannot_be_solved_is_refused(monkeypatch):
    monkeypatch.setattr(module, 'press_sheet', lambda mesh, steps, *more: (
        np.full((len(steps), mesh.side**2, 3), np.nan), np.full((len(steps), 9), np.nan)))
    with pytest.raises(BadCalibration, match='converge'):
        build_library(PLAN, MATERIAL)


def test_a_few_unsolved_presses_are_extrapolated_linearly(monkeypatch):
    plan = dataclasses.replace(PLAN, n=2, levels=8, order=3)

    def ramp(mesh, steps, radius, material, drag=None):
        field = np.ones((mesh.side**2, 3)) * steps[:, None, None]
        field[(steps > 0.99 * plan.depth) & (mesh.position[0] > 0.9 * plan.reach[0]) & (mesh.position[1] > 0.9 * plan.reach[1])] = np.nan
        return field, np.ones((len(steps), 9)) * -steps[:, None]
    monkeypatch.setattr(module, 'press_sheet', ramp)
    deep = Press(plan.positions[:, 0], 0.999999 * plan.depth)
    moved = show(build_library(plan, MATERIAL), [deep], deep.position[None], EYE[:1])[1][0, 0]
    assert moved == pytest.approx(np.full(3, plan.depth), rel=1e-3)


def test_the_library_is_restored_from_a_calibration_file(tmp_path):
    write_calibration(tmp_path / 'file.yaml', CalibrationFile('areal_single', {}, stored(library()), {}, {}))
    again = restored(SheetLibrary, read_calibration(tmp_path / 'file.yaml', 'areal_single').fitted)
    press = Press(np.array([0.01, -0.004]), 5e-3, 0.1, (0.3, 0.1))
    fields = [show(one, [press], GRID, EYE)[1][:, 0] for one in (library(), again)]
    assert np.abs(fields[1] - fields[0]).max() < 5e-6
    assert again.plan == library().plan
