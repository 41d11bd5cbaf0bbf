# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.press.identification import Prior, beyond, identify

WIDE = Prior(np.zeros(2), np.ones(2), np.full(2, -3.0), np.full(2, 3.0))


def test_numbers_of_a_simulation_are_found_with_few_of_it():
    true, asked = np.array([0.7, -0.4]), {True: 0, False: 0}

    def shown(numbers, coarse):
        return np.array([np.exp(numbers[0]), numbers[0] * numbers[1] + numbers[1], numbers.sum()]) * (0.98 if coarse else 1.0)

    def residuals(several, coarse):
        asked[coarse] += len(several)
        return [1e3 * (shown(numbers, coarse) - shown(true, False)) for numbers in several]

    found = identify(residuals, [np.array([2.0, 2.0]), np.array([0.0, 0.0])], WIDE)
    assert found == pytest.approx(true, abs=2e-3) and asked[True] <= 5 and asked[False] <= 10


def test_what_the_data_do_not_tell_is_the_prior_and_bounds_hold():
    found = identify(lambda several, coarse: [10 * (one[:1] - 5.0) for one in several], [np.full(2, 0.5)], WIDE)
    assert found == pytest.approx([3.0, 0.0], abs=0.05)


def test_errors_beyond_their_variance_are_those_of_most():
    errors = np.random.default_rng(0).normal(0, 0.5, (400, 8))
    errors[0] = 1e3
    assert beyond(errors, np.full(errors.shape, 0.16)) == pytest.approx(0.3, abs=0.05) and beyond(errors, np.ones(errors.shape)) == 0.0
