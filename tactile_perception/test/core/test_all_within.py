# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception._core import all_within


@pytest.mark.parametrize('shape', [(), (0,), (7,), (3, 2), (2, 3, 4)])
def test_all_numbers_must_be_within(shape):
    values = np.full(shape, -2.0)
    assert all_within(values) and all_within(values, most=2.0)
    assert all_within(values, most=1.9) == (values.size == 0)
    for bad in (np.nan, np.inf, -np.inf):
        other = np.append(values.ravel(), bad)
        assert not all_within(other) and not all_within(other[None])
