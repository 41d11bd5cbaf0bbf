# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.rotations import matrix_of_quaternion, quaternion, rotation_matrix, rotation_vector


def test_half_a_turn_keeps_its_axis():
    for axis in np.eye(3):
        assert abs(rotation_vector(rotation_matrix(np.pi * axis)) @ axis) == pytest.approx(np.pi)
    tilted = np.pi * np.array([0.6, -0.8, 0.0])
    assert abs(rotation_vector(rotation_matrix(tilted)) @ tilted) == pytest.approx(np.pi**2)


@pytest.mark.parametrize('vector', [[0, 0, 0], [3.1, 0, 0], [0, -3.0, 0.2], [0.1, 0.2, 3.0], [1, 1, 1]])
def test_quaternion_is_that_of_the_rotation(vector):
    angle = np.linalg.norm(vector)
    axis = np.array(vector) / max(angle, 1e-9)
    found = quaternion(rotation_matrix(np.array(vector, float)))
    np.testing.assert_allclose(found, [*np.sin(angle / 2) * axis, np.cos(angle / 2)], atol=1e-9)
    np.testing.assert_allclose(matrix_of_quaternion(found), rotation_matrix(np.array(vector, float)), atol=1e-12)
