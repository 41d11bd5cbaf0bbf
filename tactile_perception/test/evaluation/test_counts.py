# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scores of labels, by hand."""
import numpy as np
import pytest
from tactile_perception.evaluation.counts import counts, f1, label_f1, macro_f1


def test_f1():
    assert f1(8, 2, 2) == pytest.approx(0.8)
    assert np.isnan(f1(0, 0, 0))


def test_counts_of_judged_entries():
    found, there = np.array([True, True, False, False, True]), np.array([True, False, True, False, False])
    assert counts(found, there).tolist() == [1, 2, 1]
    assert counts(found, there, np.array([True, True, True, True, False])).tolist() == [1, 1, 1]


def test_label_f1_takes_the_last_column_for_what_was_not_found():
    confusion = np.array([[6, 2, 0, 2], [0, 3, 0, 0], [0, 0, 0, 0]])
    found = label_f1(confusion)
    assert found[:2] == pytest.approx([12 / 16, 6 / 8]) and np.isnan(found[2])


def test_macro_f1_leaves_out_states_that_do_not_occur():
    assert macro_f1(np.array([[8, 2, 0], [0, 0, 0], [0, 0, 5]])) == pytest.approx((16 / 18 + 1) / 2)
    assert np.isnan(macro_f1(np.zeros((3, 3), int)))
