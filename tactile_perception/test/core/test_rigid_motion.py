# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel rigid_motion (src/common/rigid_motion.cpp) against references in NumPy."""
import numpy as np
import pytest
from tactile_perception._core import rigid_motion

TUKEY, NEAR, PATCH, STARTS = 4.685, 2.0, 9, 24
TOO_FEW, BEFORE_AT_ONE_PLACE, AFTER_AT_ONE_PLACE, BEFORE_ON_A_LINE, AFTER_ON_A_LINE, REFLECTION = range(1, 7)
SIGMA = 20e-6


def kabsch(p, q, w):
    """Rotation and translation by singular values."""
    w = w / max(w.sum(), 1e-300)
    p_mean, q_mean = w @ p, w @ q
    u, _, vt = np.linalg.svd((w[:, None] * (q - q_mean)).T @ (p - p_mean))
    u[:, 2] *= np.sign(np.linalg.det(u @ vt))
    return u @ vt, q_mean - u @ vt @ p_mean


def squares(motion, p, q, base):
    """Squared residuals over the variance of a coordinate."""
    return np.square(q - p @ motion[0].T - motion[1]).sum(axis=1) * base


def starts(p):
    """Indices of the points of each start but the first."""
    centres = np.arange(min(STARTS, len(p))) * (len(p) - 1) // (min(STARTS, len(p)) - 1)
    near = [np.argsort(np.square(p - p[k]).sum(axis=1), kind='stable')[:PATCH] for k in centres]
    return near + list((np.arange(3 * STARTS) * 0.6180339887498949 % 1 * len(p)).astype(int).reshape(-1, 3))


def reference(p, q, base, steps):
    """The weights, step by step."""
    motion = kabsch(p, q, base)
    if len(p) > PATCH and np.mean(squares(motion, p, q, base) < 3 * NEAR**2) <= 0.8:
        motions = [kabsch(p[some], q[some], base[some]) for some in starts(p)]
        motion = min(motions, key=lambda each: np.minimum(squares(each, p, q, base), 3 * NEAR**2).sum())
    weights = base
    for _ in range(steps):
        before, weights = weights, base * np.maximum(1 - squares(motion, p, q, base) / (3 * TUKEY**2), 0)**2
        if np.abs(weights - before).max() < 1e-2 * weights.max():
            break
        motion = kabsch(p, q, weights)
    return weights


@pytest.mark.parametrize('seed', range(20))
@pytest.mark.parametrize('flat', [1.0, 1e-2, 0.0])
@pytest.mark.parametrize('mirror', [1, -1])
def test_least_squares_are_those_of_singular_values(seed, flat, mirror):
    rng = np.random.default_rng(seed)
    p = rng.normal(0, 3e-3, (rng.integers(4, 120), 3)) * [1, 0.7, flat]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn[0] *= np.sign(np.linalg.det(turn))
    q = p * [1, 1, mirror] @ turn.T + rng.normal(0, 1e-3, 3) + rng.normal(0, SIGMA, p.shape)
    w = rng.uniform(0.5, 2, len(p)) / SIGMA**2
    rotation, translation, residuals, weights, opened = rigid_motion(p, q, w, steps=0)
    expected, shift = kabsch(p, q, w)
    share = w / w.sum()
    u, values, vt = np.linalg.svd((share[:, None] * (q - share @ q)).T @ (p - share @ p))
    assert np.abs(rotation - expected).max() < 1e-11
    assert np.abs(translation - shift).max() < 1e-13
    assert np.abs(residuals - (q - p @ expected.T - shift)).max() < 1e-13
    np.testing.assert_array_equal(weights, w)
    assert opened == (REFLECTION if -values[2] * np.linalg.det(u @ vt) > 1e-2 * values[1] else 0)


@pytest.mark.parametrize('seed', range(30))
def test_weights_are_those_of_the_reference(seed):
    rng = np.random.default_rng(seed)
    count, outliers = rng.integers(4, 120), rng.uniform(0, 0.45)
    p = rng.normal(0, 3e-3, (count, 3))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] if seed % 2 else np.eye(3)
    q = p @ (turn * np.sign(np.linalg.det(turn))).T + rng.normal(0, 1e-3, 3) + rng.normal(0, SIGMA, (count, 3))
    q[:int(outliers * count)] += rng.normal(0, 1e-3, (int(outliers * count), 3))
    base = rng.uniform(0.5, 2, count) / SIGMA**2
    np.testing.assert_allclose(rigid_motion(p, q, base, steps=10)[3], reference(p, q, base, 10), rtol=1e-4, atol=1e-6 * base.max())


def test_those_that_move_otherwise_have_no_weight():
    rng = np.random.default_rng(3)
    p = rng.normal(0, 3e-3, (60, 3))
    q = p + [1e-3, 0, 0]
    other = p[:, 0] > 1.5e-3
    q[other] -= [0, 1e-3, 0]
    np.testing.assert_array_equal(rigid_motion(p, q, np.full(60, SIGMA**-2), steps=10)[3] > 0, ~other)


LINE = np.outer(np.arange(5.0), [1e-3, 2e-3, 0])
CORNERS = np.array([[0, 0, 0], [1e-3, 0, 0], [0, 1e-3, 0], [0, 0, 1e-3], [1e-3, 1e-3, 0]])


@pytest.mark.parametrize('steps', [0, 10])
@pytest.mark.parametrize('opened, p, q', [
    (0, CORNERS, CORNERS + 1e-3), (TOO_FEW, np.zeros((0, 3)), np.zeros((0, 3))), (TOO_FEW, CORNERS[:2], CORNERS[:2]),
    (BEFORE_AT_ONE_PLACE, 0 * CORNERS, CORNERS), (AFTER_AT_ONE_PLACE, CORNERS, 0 * CORNERS), (BEFORE_ON_A_LINE, LINE, CORNERS),
    (AFTER_ON_A_LINE, CORNERS, LINE), (REFLECTION, CORNERS, CORNERS * [1, 1, -1])])
def test_why_points_leave_a_motion_open(opened, p, q, steps):
    weights = np.full(len(p), 1e-3**-2)
    found = rigid_motion(p, q, weights, steps=steps)
    assert found[4] == opened and found[2].shape == p.shape and found[3].shape == weights.shape
