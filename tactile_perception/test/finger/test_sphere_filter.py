# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.errors import BadArgument
from tactile_perception.finger.map import direction, error_angle
from tactile_perception._core.finger import SphereFilter

STEP, SIGMA = 5e-3, np.radians(1.0)


def filtered(normals, rng, acceleration=20.0):
    smooth, found, squares = SphereFilter(acceleration), [], []
    for normal in normals:
        seen = normal + rng.normal(0, SIGMA, 3)
        seen /= np.linalg.norm(seen)
        estimate, spread = smooth.update(seen, SIGMA**2 * (np.eye(3) - np.outer(seen, seen)), STEP)
        found.append(estimate)
        error = estimate - normal
        squares.append(error @ np.linalg.pinv(spread, rcond=1e-6) @ error / 2)
    return np.array(found), np.array(squares)


def test_motion_over_the_pole_is_followed_without_lag():
    t = np.arange(600) * STEP
    normals = direction(np.zeros(600), -1.0 + 0.7 * t)
    found, squares = filtered(normals, np.random.default_rng(0))
    error = error_angle(found, normals)[100:]
    assert np.sqrt(np.mean(error**2)) < 0.6 * np.sqrt(2) * SIGMA
    assert abs(np.mean((found - normals)[100:, 0])) < 0.1 * SIGMA
    assert 0.3 < np.mean(squares[100:]) < 1.5


def test_azimuth_pi_is_regular():
    t = np.arange(600) * STEP
    normals = direction(np.pi + 0.8 * np.sin(2 * t), np.full(600, 0.6))
    found, _ = filtered(normals, np.random.default_rng(1))
    assert np.degrees(error_angle(found, normals)[50:]).max() < 3.0
    assert np.linalg.norm(found, axis=1) == pytest.approx(1.0)


def test_a_change_of_velocity_is_followed_within_the_stated_time():
    normals = np.repeat(direction(np.zeros(2), np.array([0.3, 0.3])), 300, axis=0)
    normals[300:] = direction(np.zeros(300), 0.3 + 0.5 * STEP * np.arange(300))
    found = np.mean([filtered(normals, np.random.default_rng(k))[0] for k in range(20)], axis=0)
    late = error_angle(found, normals)[300:]
    wait = np.sqrt(2 * SIGMA / 20.0)
    assert late[int(4 * wait / STEP):].max() < 0.6 * SIGMA


def test_repeated_and_reversed_stamps():
    smooth = SphereFilter(10.0)
    normal = np.array([0, 0, 1.0])
    for seconds in (0.0, -1.0, 0.0, 1e-9):
        found, spread = smooth.update(normal, 1e-4 * np.diag([1.0, 1, 0]), seconds)
    assert found == pytest.approx(normal) and np.isfinite(spread).all()
    with pytest.raises(BadArgument):
        SphereFilter(0.0)
