# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.dots.pattern_numbers import PatternNumbers
from tactile_perception.errors import BadFrame


@pytest.fixture
def uv():
    row, column = np.divmod(np.arange(60), 10)
    return np.stack([column * 20.0, row * 20.0], 1) + np.random.default_rng(0).uniform(-6, 6, (60, 2))


def test_the_first_frame_numbers_all_that_follow(uv):
    numbers, order = PatternNumbers(), np.random.default_rng(1).permutation(60)
    assert np.array_equal(numbers.update(uv, 0.0), np.arange(60))
    assert np.all(numbers.update(uv[:20], 1.0) == -1)
    assert np.array_equal(numbers.update(uv[order] + [9, 3], 900.0), order)


def test_a_calibrated_pattern_numbers_the_first_frame_too(uv):
    order = np.random.default_rng(1).permutation(60)
    assert np.array_equal(PatternNumbers(uv).update(uv[order] + 2, 0.0), order)


def test_a_first_frame_of_few_dots_is_a_bad_one(uv):
    numbers = PatternNumbers()
    with pytest.raises(BadFrame, match='at least 8'):
        numbers.update(uv[:5], 0.0)
    assert np.array_equal(numbers.update(uv, 1.0), np.arange(60))
