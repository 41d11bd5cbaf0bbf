# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.evaluation.evaluation import QUANTITIES, spread


def test_spread_in_the_unit_of_the_quantity():
    found = spread(1e-3 * np.array([-3.0, 1.0, -2.0]), QUANTITIES['depth'])
    assert [found[name] for name in ('median', 'worst', 'bias')] == pytest.approx([2, 3, -2]) and found['count'] == 3
    assert found['within_95'] == pytest.approx(2.9)
    assert np.isnan(spread(np.zeros(0), QUANTITIES['depth'])['median'])


def test_of_an_overlap_the_least_is_the_worst():
    found = spread(np.linspace(0, 1, 101), QUANTITIES['region_overlap'])
    assert found['worst'] == 0 and found['within_95'] == pytest.approx(0.05) and 'bias' not in found
