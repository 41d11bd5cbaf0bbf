# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from scipy.interpolate import BSpline
from tactile_perception.common.splines import spline_fit


@pytest.mark.parametrize('levels', [4, 14])
def test_values_of_a_cubic_are_met_at_and_between_levels(levels):
    cubic = np.poly1d([0.3, -1.0, 2.0, 5.0])
    coefficients = spline_fit(levels) @ cubic(np.arange(levels + 1))
    at = np.linspace(0, levels, 50)
    assert np.allclose(BSpline(np.arange(-3, levels + 4), coefficients, 3)(at), cubic(at))
