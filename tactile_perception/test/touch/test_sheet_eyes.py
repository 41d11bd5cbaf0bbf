# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.touch.field import MarkerField
from tactile_perception.touch.sheet_eyes import EyeShifts


def test_each_marker_gets_the_shift_of_its_own_eye():
    eye = np.array([[-0.03, 0, -0.05], [-0.0301, 0, -0.05], [0.03, 0, -0.05], [np.nan] * 3])
    nothing = np.zeros((4, 2))
    field = MarkerField(nothing, nothing, np.zeros(4), eye, np.zeros(4), nothing, nothing, np.zeros(4))
    eyes = EyeShifts.of(field)
    assert len(eyes.eyes) == 2
    shifted = EyeShifts(eyes.eyes, np.array([[1e-4, 0], [0, 2e-4]])).shifted(field)
    assert shifted.eye[:3] - eye[:3] == pytest.approx(np.array([[1e-4, 0, 0], [1e-4, 0, 0], [0, 2e-4, 0]]))
    assert np.isnan(shifted.eye[3]).all()
