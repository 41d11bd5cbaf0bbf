# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from sheet_reference import appearance
from sheet_scenes import EYE, GRID, PLAN
from tactile_perception.press.sheet.projection import Press, field_appearance


def test_a_press_is_its_vector():
    press = Press(np.array([0.011, -0.006]), 4e-3, 0.08, (0.2, -0.1))
    again = Press.of(press.vector)
    assert again.vector.tolist() == press.vector.tolist() == [0.011, -0.006, 4e-3, 0.08, 0.2, -0.1]


def test_a_sheet_at_rest_looks_as_at_rest():
    field = np.zeros(((2 * PLAN.n + 2)**2, 3))
    assert np.abs(field_appearance(field, PLAN, (0.003, 0.002), GRID, EYE, 1.2e-3)).max() < 1e-12


def test_a_sheet_that_comes_nearer_as_a_whole_looks_larger():
    field = np.zeros(((2 * PLAN.n + 2)**2, 3))
    field[:, 2] = -0.002
    seen, deformed = field_appearance(field, PLAN, (0.0, 0.0), GRID, EYE, 1e-6), np.zeros((len(GRID), 3, 3))
    deformed[:, 0, 2] = -0.002
    assert seen == pytest.approx(appearance(deformed, GRID, EYE), abs=1e-6)
    assert seen[:, :2] == pytest.approx(GRID * (0.062 / 0.060 - 1), abs=1e-7)
