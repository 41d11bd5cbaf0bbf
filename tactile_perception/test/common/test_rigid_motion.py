# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.rigid_motion import fit_rigid
from tactile_perception.common.geometry import rotation_matrix
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


def test_noise_is_averaged():
    p, rng, turn, errors = cloud(25), np.random.default_rng(1), np.array([0.02, 0.01, -0.05]), []
    for _ in range(100):
        found = fit_rigid(p, p @ rotation_matrix(turn).T + rng.normal(0, 20e-6, p.shape))
        errors.append(found.rotation_vector - turn)
    spread = np.sqrt((p - p.mean(axis=0)).var(axis=0).sum() * 2 / 3 * 25)  # of the arms of a turn about an axis
    assert np.std(errors) == pytest.approx(20e-6 / spread, rel=0.25)
