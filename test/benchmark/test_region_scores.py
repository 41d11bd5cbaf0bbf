# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import importlib.util
from pathlib import Path

import numpy as np

_SPEC = importlib.util.spec_from_file_location('region_scores', Path(__file__).with_name('region_scores.py'))
scores = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(scores)


def test_contact_counts_leave_near_free_dots_out():
    truth = {'dot_contact': np.array([[1, 1, 0, 0, 0]], bool), 'dot_gap': np.array([[0, 0, 20e-6, 80e-6, 1e-3]])}
    found = np.array([True, False, True, True, False])
    np.testing.assert_array_equal(scores.contact_counts(found, truth, 0, np.arange(5)), [1, 1, 1])


def test_slip_counts_leave_slips_near_the_tolerance_out():
    slip = np.zeros((1, 4, 3))
    slip[0, :, 0] = [2e-6, 20e-6, 50e-6, 50e-6]
    truth = {'dot_state': np.array([[1, 2, 2, 2]]), 'dot_slip': slip}
    sticking, slipping = scores.slip_counts(np.array([1, 1, 1, 2]), truth, 0, np.arange(4))
    np.testing.assert_array_equal(sticking, [1, 1, 0])
    np.testing.assert_array_equal(slipping, [1, 0, 1])


def test_place_errors():
    truth = {'contact_centroid': np.array([[1e-3, 0, 0]]), 'depth': np.array([2e-3]), 'contact_area': np.array([50e-6])}
    np.testing.assert_allclose(scores.place_errors(np.array([1e-3, 1e-3, 5]), 2.1e-3, 55e-6, truth, 0), [1e-3, 0.1e-3, 1.1])


def test_true_loops_are_those_of_the_frame():
    truth = {'loop_start': np.array([0, 3, 7]), 'loop_frame': np.array([4, 5]), 'loop_xyz': np.arange(21.0).reshape(7, 3)}
    assert [len(loop) for loop in scores.true_loops(truth, 5)] == [4]
    assert scores.true_loops(truth, 6) == []
