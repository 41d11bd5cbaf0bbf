# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')
from tactile_perception.offline.calibrate_taxels import Loads, held_out_errors  # noqa: E402
from tactile_perception.taxel.array import TaxelArray  # noqa: E402

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
