# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.psd.geometry import (
    MIX, TOTAL, angles, direction, error_angle, exp_map, log_map, position, position_covariance)

PHI = np.array([0.0, 1.0, np.pi, -np.pi, -2.0, 3.1])
THETA = np.array([0.0, 0.4, 1.2, 1.2, 1e-9, 1.5])


def test_angles_there_and_back():
    normal = direction(PHI, THETA)
    assert np.linalg.norm(normal, axis=1) == pytest.approx(1.0)
    phi, theta = angles(normal)
    assert theta == pytest.approx(THETA)
    assert np.cos(phi - PHI)[1:] == pytest.approx(1.0)
    assert angles(np.array([0.0, 0.0, 1.0])) == (0.0, 0.0)


def test_the_logarithmic_map_keeps_distances_to_the_pole():
    normal = direction(PHI, THETA)
    assert np.linalg.norm(log_map(normal), axis=1) == pytest.approx(THETA)
    assert exp_map(log_map(normal)) == pytest.approx(normal)
    assert exp_map(np.zeros(2)) == pytest.approx([0, 0, 1])


def test_small_and_large_error_angles_are_exact():
    a, b = direction(np.array([0.3, 0.3]), np.array([0.5, 0.0])), direction(np.array([0.3, 0.3]), np.array([0.5 + 1e-9, 3.0]))
    assert error_angle(a, b) == pytest.approx([1e-9, 3.0], rel=1e-6)


RNG = np.random.default_rng(0)


def test_equation_1():
    x1, y1, x2, y2 = net = np.array([0.4, 0.7, 1.1, 0.3])
    total = net.sum()
    expected = np.array([-x1 + y1 + x2 - y2, -x1 - y1 + x2 + y2]) / total
    assert position((net @ MIX)[None])[0] == pytest.approx(expected)


def test_equal_outputs_are_the_centre_and_no_light_is_nan():
    assert position(np.full((1, 4), 0.3) @ MIX)[0] == pytest.approx([0, 0])
    assert np.isnan(position(np.array([[0.0, 0, 0, 0], [-1.0, 0, 0, 0]]) @ MIX)).all()


def test_the_covariance_is_that_of_many_noisy_samples_and_grows_as_light_falls():
    net, sigma, shot = np.array([0.3, 0.9, 0.5, 0.2]), 0.004, 2e-5
    noisy = net + RNG.normal(0, 1, (200_000, 4)) * np.sqrt(sigma**2 + shot * net)
    found = np.cov(position(noisy @ MIX).T)
    sums, noise = net @ MIX, sigma**2 * MIX.T @ MIX
    estimate = position_covariance(position(sums[None])[0], sums[TOTAL], noise, shot)
    assert estimate == pytest.approx(found, rel=0.05, abs=6e-7)
    weak = position_covariance(position(sums[None])[0], sums[TOTAL] / 10, noise, 0.0)
    assert weak == pytest.approx(100 * position_covariance(position(sums[None])[0], sums[TOTAL], noise, 0.0))
