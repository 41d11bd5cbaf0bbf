# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.vectors import cross, tangents

A, B = np.random.default_rng(0).normal(size=(2, 3, 4, 5))


def test_products_are_those_of_numpy():
    assert cross(A, B) == pytest.approx(np.cross(A, B, axis=0))
    assert cross(A[:, 0, 0], B[:, 0, 0]) == pytest.approx(np.cross(A[:, 0, 0], B[:, 0, 0]))


@pytest.mark.parametrize('normal', [[0, 0, 1.0], [0, 1.0, 0], [-0.6, 0, 0.8]])
def test_tangents(normal):
    basis = np.vstack([tangents(np.array(normal)), normal])
    assert basis @ basis.T == pytest.approx(np.eye(3), abs=1e-12)
