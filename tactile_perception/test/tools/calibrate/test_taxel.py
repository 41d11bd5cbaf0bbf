# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Loads that are held out are predicted by the others, and their errors are told by force and place."""
import numpy as np
import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')
from tactile_perception.calibration.residuals import outliers  # noqa: E402
from tactile_perception.taxel.array import TaxelArray  # noqa: E402
from tactile_perception.tools.calibrate.taxel import Loads, held_out_errors, held_out_residuals  # noqa: E402

pytestmark = pytest.mark.ros


def test_held_out_loads_of_a_straight_sensor_are_exact():
    loads = np.linspace(10, 100, 9)
    changes = np.zeros((9, 5, 5), np.float32)
    changes[:, 1:4, 1:4] = loads[:, None, None]
    errors = held_out_errors(Loads(changes, 0.02 * loads, None, [], [''] * len(loads)), TaxelArray(5, 5, 1e-3), None)
    assert np.abs(errors).max() < 1e-3


def test_too_few_loads_have_no_held_out_error():
    changes = np.ones((3, 2, 2), np.float32) * np.array([1, 2, 3], np.float32)[:, None, None]
    assert np.isnan(held_out_errors(Loads(changes, np.array([1.0, 2.0, 3.0]), None, [], [''] * 3), TaxelArray(2, 2, 1e-3), None)).all()


def test_errors_are_told_by_force_and_where_loads_differ_in_place_over_the_pad():
    changes = np.zeros((6, 5, 5))
    changes[:, 2, 2] = 1
    array, forces = TaxelArray(5, 5, 1e-3), np.arange(1.0, 7)
    errors = np.array([0.01, -0.01, 0.02, -0.02, 0.01, 0.5])
    loads = Loads(changes, forces, None, [], [f'bag at {k} s' for k in range(6)])
    found, = held_out_residuals(loads, array, errors)
    assert found.value == pytest.approx(100 * errors) and found.place[:, 0] == pytest.approx(forces)
    assert outliers([found]) == ['bag at 5 s: force error 50 %, the median is 1.5 %']
    changes[0] = np.roll(changes[0], 2, axis=1)
    _, over = held_out_residuals(loads, array, errors)
    assert over.place[0] == pytest.approx([2.0, 0.0]) and over.place[1] == pytest.approx([0.0, 0.0])
