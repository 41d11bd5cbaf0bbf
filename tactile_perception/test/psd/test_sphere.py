# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.psd.sphere import angles, bent, direction, error_angle, flat, tangents

PHI = np.array([0.0, 1.0, np.pi, -np.pi, -2.0, 3.1])
THETA = np.array([0.0, 0.4, 1.2, 1.2, 1e-9, 1.5])


def test_angles_there_and_back():
    normal = direction(PHI, THETA)
    assert np.linalg.norm(normal, axis=1) == pytest.approx(1.0)
    phi, theta = angles(normal)
    assert theta == pytest.approx(THETA)
    assert np.cos(phi - PHI)[1:] == pytest.approx(1.0)
    assert angles(np.array([0.0, 0.0, 1.0])) == (0.0, 0.0)


def test_the_plane_keeps_distances_to_the_pole():
    normal = direction(PHI, THETA)
    assert np.linalg.norm(flat(normal), axis=1) == pytest.approx(THETA)
    assert bent(flat(normal)) == pytest.approx(normal)
    assert bent(np.zeros(2)) == pytest.approx([0, 0, 1])


def test_error_angles_are_exact_where_an_arc_cosine_is_not():
    a, b = direction(np.array([0.3, 0.3]), np.array([0.5, 0.0])), direction(np.array([0.3, 0.3]), np.array([0.5 + 1e-9, 3.0]))
    assert error_angle(a, b) == pytest.approx([1e-9, 3.0], rel=1e-6)


@pytest.mark.parametrize('normal', [[0, 0, 1.0], [0, 1.0, 0], [-0.6, 0, 0.8]])
def test_tangents(normal):
    basis = np.vstack([tangents(np.array(normal)), normal])
    assert basis @ basis.T == pytest.approx(np.eye(3), abs=1e-12)
