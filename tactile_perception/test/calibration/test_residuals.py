# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Presses whose error stands out are named by their time; even ones are not."""
import numpy as np
from tactile_perception.calibration.residuals import Residuals, outliers


def made(value):
    value = np.asarray(value, float)
    when = [f'bag at {k}.000 s' for k in range(len(value))]
    return Residuals('depth', 'mm', value, np.zeros((len(value), 2)), ('x (mm)', 'y (mm)'), when)


def test_the_press_that_stands_out_is_named_with_its_error_and_what_is_usual():
    value = np.random.default_rng(0).normal(0, 0.1, 40)
    value[[7, 30]] = 1.9, -2.5
    assert outliers([made(value)]) == ['bag at 30.000 s: depth 2.5 mm off, 0.054 mm is usual',
                                       'bag at 7.000 s: depth 1.9 mm off, 0.054 mm is usual']


def test_nothing_stands_out_of_even_errors_of_few_or_of_unknown_ones():
    assert outliers([made(np.random.default_rng(1).normal(0, 0.1, 200))]) == []
    assert outliers([made([0, 0, 0, 5.0]), made(np.full(9, np.nan)), made([])]) == []
    assert outliers([made([*np.full(9, 0.1), np.nan])]) == []
