# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import dataclasses
import functools

import numpy as np
import pytest
from sheet_scenes import EYE, GRID, MATERIAL, PLAN, SENSOR, field_of, library, pressed
from tactile_perception.press.sheet.calibration import calibrate_sheet
from tactile_perception.press.sheet.mechanics import SheetMesh, press_sheet
from tactile_perception.press.sheet.model import (CameraShifts, FieldNoise, Seen, SheetCalibration, SheetInverse, SheetModelMethod,
                                                  SheetStart, show)
from tactile_perception.press.sheet.library import Press
from tactile_perception.press.presses import Presses
from tactile_perception.press.estimate import AMBIGUOUS, OUT_OF_RANGE

NOISE = FieldNoise(5e-6, 5e-3, 3e-3, 1.5)
COVERED = np.array([[-0.018, -0.011], [0.018, 0.011]])


@functools.cache
def fitted():
    return SheetCalibration(library(), 1.2e-3, CameraShifts(np.array([[0, 0, -0.062]]), np.zeros((1, 2))), NOISE, 3e-5, 0.01,
                            COVERED, 6e-3)


@functools.cache
def common_method():
    return SheetModelMethod(fitted(), SENSOR)


STILL = field_of(np.zeros((len(GRID), 3)), 5e-6, 5e-3)


def begun(field):
    """The touches of the first frame of a touch."""
    assert common_method().estimate(STILL) == []
    return common_method().estimate(field)


def touches(*press, noise=5e-6, growth=5e-3, seed=0):
    return begun(field_of(pressed(*press), noise, growth, seed))


def together(presses, mixed=0.2, seed=0):
    """The touches of presses whose sum lacks a part of what they share."""
    return begun(field_of(show(library(), presses, GRID, EYE, mixed)[0], 2e-6, 2e-3, seed))


@pytest.mark.parametrize('one, other', [((-0.010, 0.003, 3e-3), (0.006, -0.004, 2.4e-3)), ((-0.008, -0.006, 4e-3), (0.004, 0.005, 3.5e-3)),
                                        ((0.0, 0.0, 2e-3), (0.012, 0.002, 2e-3)), ((-0.008, 0.0, 3e-3), (0.008, 0.0, 3e-3))])
def test_two_presses_are_reported_apart_at_the_centres_of_what_touches(one, other):
    found = together([Press(np.array(press[:2]), press[2]) for press in (one, other)])
    assert len(found) == 2 and np.isnan([touch.wrench for touch in found]).all()
    for touch, press in zip(sorted(found, key=lambda touch: touch.position[0]), (one, other)):
        assert np.abs(touch.position[:2] - press[:2]).max() < 8e-4
        assert touch.depth > press[2] and touch.depth + touch.position[2] > 0, 'above the lowest point'


@pytest.mark.parametrize('radius, depth', [(21e-3, 6e-3), (28e-3, 5e-3)])
def test_two_tips_beyond_the_model_are_two_and_their_places_errors_say_so(radius, depth):
    truth = [(-0.013, 0.002, 3e-3, PLAN.radius), (0.013, -0.003, depth, radius)]
    found = begun(field_of(sum(pressed(*press) for press in truth), 5e-6, 5e-3))
    assert len(found) == 2
    for touch, press in zip(sorted(found, key=lambda touch: touch.position[0]), truth):
        off = touch.position[:2] - press[:2]
        assert np.hypot(*off) < 3e-3 and off @ np.linalg.solve(touch.covariance[:2, :2], off) / 2 < 3


@pytest.mark.parametrize('place', [(0.0, 0.0), (0.012, -0.007), (-0.015, 0.010), (0.003, 0.0145)])
def test_one_tip_of_any_size_is_one(place):
    for depth, radius in ((1e-3, 7e-3), (4e-3, 5.6e-3), (4e-3, 8.75e-3)):
        for seed in range(4):
            touch, = touches(*place, depth, radius, seed=seed)
            assert np.hypot(*(touch.position[:2] - place)) < 8e-4


def test_a_drag_is_reported_from_a_press_elsewhere_and_from_two():
    touch, = together([Press(np.array([0.005, -0.003]), 4e-3, drag=(0.4, -0.25))])
    assert np.abs(touch.position - [0.005, -0.003, -4e-3]).max() < 2e-4
    straight, = together([Press(np.array([0.005, -0.003]), 4e-3)])
    assert (touch.wrench / touch.wrench[2] - straight.wrench / straight.wrench[2])[:2] == pytest.approx([-0.4, 0.25], abs=0.03)


def test_a_second_press_is_reported_once_it_stands_out():
    one = Press(np.array([-0.008, 0.0]), 4e-3)
    reported = [len(together([one] + ([Press(np.array([0.010, 0.004]), 1.5e-4 * k)] if k else []), seed=k)) for k in range(25)]
    assert reported[0] == 1 and reported[-8:] == [2] * 8


def test_a_touch_is_reported_with_its_uncertainty():
    touch, = touches(0.012, -0.007, 4e-3, 8e-3)
    assert touch.position == pytest.approx([0.012, -0.007, -4e-3], abs=1.5e-4) and touch.depth == -touch.position[2]
    assert touch.radius == pytest.approx(8e-3, rel=0.25) and touch.flags == 0
    assert 3e-5 < np.sqrt(touch.covariance[0, 0]) < 3e-4 and touch.depth_sigma == pytest.approx(np.sqrt(touch.covariance[2, 2]))
    assert np.linalg.eigvalsh(touch.covariance).min() > 0


def test_a_press_is_as_uncertain_as_other_friction_makes_it():
    squares = []
    for friction in (0.2, 0.8):
        for place, depth, radius in (((0.0, 0.0), 3e-3, 7e-3), ((0.010, -0.006), 5e-3, 8e-3), ((-0.012, 0.005), 4e-3, 6e-3)):
            touch, = touches(*place, depth, radius, dataclasses.replace(MATERIAL, friction=friction))
            squares.append((touch.depth - depth)**2 / touch.depth_sigma**2)
    assert 0.1 < np.mean(squares) < 2


def test_places_are_reported_in_the_frame_of_the_sheet():
    shift, turn = np.array([3e-4, -2e-4]), 5e-3
    aside = dataclasses.replace(fitted(), camera_centres=dataclasses.replace(fitted().camera_centres, printed=shift, turned=turn))
    field = field_of(pressed(0.004, -0.003, 3e-3))
    (there,), (here,) = (SheetModelMethod(one, SENSOR).estimate(field) for one in (aside, fitted()))
    x, y = here.position[:2]
    # the clamp does not move with the print
    assert there.position - here.position == pytest.approx([shift[0] - turn * y, shift[1] + turn * x, 0], abs=8e-5)


def test_a_second_camera_that_sees_a_moving_tip_late_misleads_little():
    """Two cameras, each over its half; the right one exposes after 15 % of the motion from frame to frame, which nobody tells."""
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


def test_shallow_touches_are_reported():
    touch, = touches(-0.006, 0.004, 3e-4)
    off = touch.position - [-0.006, 0.004, -3e-4]
    assert np.hypot(*off[:2]) < 2e-3 and abs(off[2]) < 5e-5 and off @ np.linalg.solve(touch.covariance, off) < 20


def test_nothing_touches_in_noise():
    still = np.zeros((len(GRID), 3))
    assert not any(common_method().estimate(field_of(still, 5e-6, 5e-3, seed)) for seed in range(300))


def test_what_was_not_calibrated_is_flagged():
    deep, = touches(0.0, 0.0, 7e-3)
    outside, = touches(0.0, 0.0158, 3e-3)
    assert deep.flags & OUT_OF_RANGE and outside.flags & OUT_OF_RANGE


def test_a_touch_where_no_marker_is_seen_is_not_reported():
    seen, right = field_of(pressed(0.012, 0.0, 3e-3), 5e-6, 5e-3), GRID[:, 0] > -0.002
    assert len(common_method().estimate(seen)) == 1
    half = dataclasses.replace(seen, shift=np.where(right[:, None], np.nan, seen.shift))
    assert all(np.abs(found.position[0] + 0.002) < 0.012 for found in common_method().estimate(half))


def test_what_no_press_explains_is_reported_by_two_cameras_from_the_second_frame_on():
    camera_centres, shift = CameraShifts(np.array([[-0.03, 0, -0.062], [0.03, 0, -0.062]]), np.zeros((2, 2))), pressed(0.010, 0.0, 4e-3)
    method = SheetModelMethod(dataclasses.replace(fitted(), camera_centres=camera_centres), SENSOR)
    torn = field_of(np.where(GRID[:, :1] > 0.006, 0.2 * shift, shift), 5e-6, 5e-3)  # the right camera is far behind
    assert method.estimate(field_of(0 * shift, 5e-6, 5e-3)) == [] and method.estimate(torn) == []
    assert all(touch.flags & AMBIGUOUS for touch in method.estimate(torn)) and len(method.estimate(torn)) > 0
    assert common_method().estimate(torn)[0].flags & AMBIGUOUS, 'one camera sees all at once'


@pytest.mark.full
def test_a_print_that_is_aside_and_turned_is_reported_by_all_presses():
    at = np.array([(x, y, depth) for x in (-0.012, 0.0, 0.011) for y in (-0.006, 0.007) for depth in (3e-3, 5e-3)])
    fields = tuple(field_of(pressed(*where), 5e-6, 5e-3, seed) for seed, where in enumerate(at))
    shift, turn = np.array([3e-4, -2e-4]), 8e-3
    position = np.column_stack([at[:, 0] - turn * at[:, 1] + shift[0], at[:, 1] + turn * at[:, 0] + shift[1], -at[:, 2]])
    presses = Presses(fields, position, at[:, 2])
    camera_centres = calibrate_sheet(presses, SENSOR, fitted()).camera_centres
    assert camera_centres.printed == pytest.approx(shift, abs=5e-5) and camera_centres.turned == pytest.approx(turn, abs=2e-3)


def test_the_wrench_is_that_of_the_mechanics():
    touch, = touches(0.010, -0.006, 4e-3)
    wrench = press_sheet(SheetMesh((0.010, -0.006), PLAN.half, PLAN.scale, 8), np.linspace(2e-4, 4e-3, 20), 7e-3, MATERIAL)[1][-1]
    exact = np.append(wrench[:3], np.cross([0.010, -0.006, -4e-3], wrench[:3]) + wrench[3:6])
    assert touch.wrench[:3] == pytest.approx(exact[:3], abs=-0.03 * exact[2]) and touch.wrench[2] == pytest.approx(exact[2], rel=0.03)
    assert touch.wrench[3:] == pytest.approx(exact[3:], abs=0.04 * np.abs(exact[3:]).max())


def test_the_same_frames_are_reported_the_same_to_the_bit_and_a_pause_forgets_what_was():
    press = [field_of(pressed(0.012, -0.007, 4e-3, 8e-3), 5e-6, 5e-3, seed) for seed in range(3)]
    still = field_of(np.zeros((len(GRID), 3)), 5e-6, 5e-3)
    reported = [[touch.position.tolist() for field in press for touch in SheetModelMethod(fitted(), SENSOR).estimate(field)]]
    for _ in range(2):
        method = SheetModelMethod(fitted(), SENSOR)
        reported.append([touch.position.tolist() for field in [press[0], still, press[1], still,
                                                               press[2]] for touch in method.estimate(field)])
    assert reported[0] == reported[1] == reported[2] and len(reported[0]) == 3


def test_covariance_is_that_of_many_trials():
    """In a world that is the library's own, noise alone scatters the estimate, as much as is said."""
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


def test_noise_louder_than_was_calibrated_does_not_stand_out():
    """Nor does it hide a press."""
    start, still = SheetStart(library(), 1e-5, 5e-3), np.zeros((len(GRID), 3))
    scores = [start.best(field_of(still, 3e-5, 2e-2, seed))[1] for seed in range(300)]
    assert max(scores) < 6 < 30 < start.best(field_of(pressed(0.006, -0.004, 3e-3), 3e-5, 2e-2))[1]
