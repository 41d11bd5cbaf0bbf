# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.statistics import median, robust_sigma, upper_median

VALUES = np.random.default_rng(0).normal(size=(2, 10001))


def test_medians_of_odd_and_even_numbers():
    odd, even = VALUES[0], VALUES[0, 1:]
    assert median(odd) == upper_median(odd) == np.median(odd) and median(even) == np.median(even)
    assert upper_median(np.array([3.0, 1.0])) == 3.0


def test_outliers_do_not_widen_the_robust_sigma():
    many = 0.01 * VALUES
    many[:, :500] = 1e3
    assert robust_sigma(many, axis=1) == pytest.approx([0.01, 0.01], rel=0.1) and robust_sigma(many) == pytest.approx(0.01, rel=0.1)
