# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.rigid_motion import fit_rigid, fit_rigid_robust
from tactile_perception.common.geometry import rotation_matrix, rotation_vector
from tactile_perception.errors import BadArgument, DegenerateFit


def cloud(count=40, seed=0):
    return np.random.default_rng(seed).uniform(-4e-3, 4e-3, (count, 3)) + [1e-3, 2e-3, 11e-3]


@pytest.mark.parametrize('angle', [0.0, 1e-9, 1e-4, 0.3, 3.0])
def test_finds_the_motion_it_was_given(angle):
    turn = angle * np.array([2, -1, 2]) / 3
    p = cloud()
    fit = fit_rigid(p, p @ rotation_matrix(turn).T + [1e-3, 0, -2e-3])
    np.testing.assert_allclose(fit.rotation_vector, turn, atol=1e-12)
    np.testing.assert_allclose(fit.translation, [1e-3, 0, -2e-3], atol=1e-14)
    np.testing.assert_allclose(fit.apply(p), p @ rotation_matrix(turn).T + [1e-3, 0, -2e-3], atol=1e-14)


@pytest.mark.parametrize('reason, p, q', [
    ('too_few', cloud(2), cloud(2)),
    ('coincident', np.ones((5, 3)), np.ones((5, 3))),
    ('collinear', np.outer(np.arange(5), [1e-3, 2e-3, 0]), np.outer(np.arange(5), [1e-3, 2e-3, 0])),
    ('reflection', cloud(), cloud() * [1, 1, -1]),
])
def test_names_the_degenerate_case(reason, p, q):
    with pytest.raises(DegenerateFit, match=reason) as caught:
        fit_rigid(p, q)
    assert caught.value.reason == reason


def test_refuses_bad_arguments():
    p = cloud()
    with pytest.raises(BadArgument):
        fit_rigid(p, p[:-1])
    with pytest.raises(BadArgument):
        fit_rigid(p, np.where(np.arange(40)[:, None] == 3, np.nan, p))
    with pytest.raises(BadArgument):
        fit_rigid(p, p, -np.ones(40))
    with pytest.raises(BadArgument):
        fit_rigid_robust(p, p, 0.0)


def test_weights_of_zero_leave_points_out():
    p = cloud()
    q = p + [1e-3, 0, 0]
    q[:10] += 5e-3
    fit = fit_rigid(p, q, (np.arange(40) >= 10).astype(float))
    np.testing.assert_allclose(fit.translation, [1e-3, 0, 0], atol=1e-12)


def test_covariance_is_honest():
    p, sigma, turn, rng = cloud(25), 20e-6, np.array([0.02, 0.01, -0.05]), np.random.default_rng(1)
    rotation = rotation_matrix(turn)
    scaled = []
    for _ in range(400):
        fit = fit_rigid(p, p @ rotation.T + rng.normal(0, sigma, p.shape), np.full(25, sigma**-2))
        error = np.concatenate([rotation_vector(fit.rotation @ rotation.T), fit.translation])
        scaled.append(error @ np.linalg.solve(fit.covariance, error))
    assert np.mean(scaled) == pytest.approx(6, rel=0.1)  # chi-squared of six numbers


def test_covariance_without_weights_comes_from_the_residuals():
    p, rng = cloud(200), np.random.default_rng(2)
    q = p + rng.normal(0, 20e-6, p.shape)
    known = fit_rigid(p, q, np.full(200, 20e-6**-2)).covariance
    assert np.diag(fit_rigid(p, q).covariance) == pytest.approx(np.diag(known), rel=0.2)


def test_robust_fit_keeps_to_what_most_share():
    p, rng = cloud(60), np.random.default_rng(3)
    q = p @ rotation_matrix([0, 0, 0.1]).T + rng.normal(0, 20e-6, p.shape)
    astray = p[:, 0] > np.quantile(p[:, 0], 0.65)
    q[astray] += [0.5e-3, 0.2e-3, 0]
    fit = fit_rigid_robust(p, q, 20e-6)
    assert np.linalg.norm(fit.rotation_vector - [0, 0, 0.1]) < 4e-3
    assert (fit.weights[astray] == 0).all()
    assert np.mean(fit.weights[~astray] > 0) > 0.95
    again = fit_rigid_robust(p, q, 20e-6)
    assert (again.rotation == fit.rotation).all()


def test_robust_fit_loses_little_where_nothing_is_astray():
    p, rng = cloud(60), np.random.default_rng(4)
    ratio = []
    for _ in range(100):
        q = p + rng.normal(0, 20e-6, p.shape)
        ratio.append([np.sum(fit_rigid_robust(p, q, 20e-6).rotation_vector**2), np.sum(fit_rigid(p, q).rotation_vector**2)])
    robust, plain = np.mean(ratio, axis=0)
    assert robust < 1.15 * plain
