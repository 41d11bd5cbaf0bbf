# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.statistics import robust_sigma, upper_median

VALUES = np.random.default_rng(0).normal(size=(2, 10001))


def test_the_upper_median_is_a_value():
    assert upper_median(VALUES[0]) == np.median(VALUES[0])
    assert upper_median(np.array([3.0, 1.0])) == 3.0


def test_outliers_do_not_widen_the_robust_sigma():
    many = 0.01 * VALUES
    many[:, :500] = 1e3
    assert robust_sigma(many, axis=1) == pytest.approx([0.01, 0.01], rel=0.1) and robust_sigma(many) == pytest.approx(0.01, rel=0.1)
