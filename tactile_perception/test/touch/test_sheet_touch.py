# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import dataclasses
import pathlib
import sys

import numpy as np
import pytest
import yaml
from tactile_perception.errors import BadCalibration
from tactile_perception.touch.estimate import AT_EDGE, OUT_OF_RANGE
from tactile_perception.touch.sheet_calibration import SheetCalibration
from tactile_perception.touch.sheet_eyes import EyeShifts
from tactile_perception.touch.sheet_inverse import FieldNoise
from tactile_perception.touch.sheet_several import Tip
from tactile_perception.touch.sheet_touch import SheetModelMethod

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from sheet_scenes import GRID, MATERIAL, SENSOR, field_of, library, pressed  # noqa: E402

NOISE = FieldNoise(5e-6, 5e-3, 3e-3, 1.5)
COVERED = np.array([[-0.018, -0.011], [0.018, 0.011]])
CALIBRATION = SheetCalibration(library(), MATERIAL, 1.2e-3, EyeShifts(np.array([[0, 0, -0.062]]), np.zeros((1, 2))), NOISE, 3e-5, 0.01,
                               COVERED, 6e-3, np.zeros(2))
METHOD = SheetModelMethod(CALIBRATION, SENSOR)


def touches(*press, noise=5e-6, growth=5e-3, seed=0):
    return METHOD.estimate(field_of(pressed(*press), noise, growth, seed))


def test_a_touch_is_told_with_its_uncertainty():
    touch, = touches(0.012, -0.007, 4e-3, 8e-3)
    assert touch.position == pytest.approx([0.012, -0.007, -4e-3], abs=1.5e-4) and touch.depth == -touch.position[2]
    assert touch.radius == pytest.approx(8e-3, rel=0.1) and touch.flags == 0 and touch.reason == ''
    assert 3e-5 < np.sqrt(touch.covariance[0, 0]) < 3e-4 and touch.depth_sigma == pytest.approx(np.sqrt(touch.covariance[2, 2]))
    assert np.linalg.eigvalsh(touch.covariance).min() > 0


def test_places_are_told_in_the_frame_of_the_presses():
    aside = SheetModelMethod(dataclasses.replace(CALIBRATION, offset=np.array([3e-4, -2e-4])), SENSOR)
    field = field_of(pressed(0.004, -0.003, 3e-3))
    (there,), (here,) = aside.estimate(field), METHOD.estimate(field)
    assert there.position - here.position == pytest.approx([-3e-4, 2e-4, 0])


def test_shallow_touches_are_told():
    touch, = touches(-0.006, 0.004, 3e-4)
    off = touch.position - [-0.006, 0.004, -3e-4]
    assert np.hypot(*off[:2]) < 2e-3 and abs(off[2]) < 5e-5 and off @ np.linalg.solve(touch.covariance, off) < 20


def test_nothing_touches_in_noise():
    still = np.zeros((len(GRID), 3))
    assert not any(METHOD.estimate(field_of(still, 5e-6, 5e-3, seed)) for seed in range(300))


def test_too_few_markers_tell_nothing():
    field = field_of(pressed(0.0, 0.0, 4e-3))
    shift = field.shift.copy()
    shift[5:] = np.nan
    assert METHOD.estimate(dataclasses.replace(field, shift=shift)) == []


def test_what_was_not_calibrated_is_flagged():
    deep, = touches(0.0, 0.0, 7e-3)
    outside, = touches(0.0, 0.0158, 3e-3)
    assert deep.flags & OUT_OF_RANGE and outside.flags & OUT_OF_RANGE


def test_a_touch_at_the_clamp_stays_on_the_sheet():
    field = field_of(pressed(0.0, 0.0160, 4e-3), 5e-6, 5e-3)
    beyond = dataclasses.replace(field, rest=field.rest - [0, 0.002])  # as if the sheet were printed a little aside
    for touch in METHOD.estimate(beyond):
        assert np.abs(touch.position[1]) < 0.0225
    assert METHOD._touch(Tip(np.append(library().plan.reach, 1e-3), np.eye(3) * 1e-10, 0.0), 1.0).flags & AT_EDGE


def test_the_calibration_file_keeps_it():
    fitted = yaml.safe_load(yaml.safe_dump(CALIBRATION.numbers()))
    field = field_of(pressed(0.012, -0.007, 4e-3, 8e-3), 5e-6, 5e-3)
    again, = SheetModelMethod.from_fitted(fitted, SENSOR).estimate(field)
    assert again.position == pytest.approx(METHOD.estimate(field)[0].position, abs=5e-6)


def test_a_broken_calibration_is_refused():
    with pytest.raises(BadCalibration, match='calibrate again'):
        SheetModelMethod.from_fitted({'noise': {}}, SENSOR)


def test_the_same_frames_are_told_the_same_to_the_bit_and_a_pause_forgets_what_was():
    press = [field_of(pressed(0.012, -0.007, 4e-3, 8e-3), 5e-6, 5e-3, seed) for seed in range(3)]
    still = field_of(np.zeros((len(GRID), 3)), 5e-6, 5e-3)
    told = [[touch.position.tolist() for field in press for touch in SheetModelMethod(CALIBRATION, SENSOR).estimate(field)]]
    for _ in range(2):
        method = SheetModelMethod(CALIBRATION, SENSOR)
        told.append([touch.position.tolist() for field in [press[0], still, press[1], still, press[2]] for touch in method.estimate(field)])
    assert told[0] == told[1] == told[2] and len(told[0]) == 3
