# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The fit of a rigid motion against the same reweighted least squares with stacked equations."""
import numpy as np
import pytest
from tactile_perception import _core

ORIGIN, ACROSS, ALONG = np.array([0.0, 0.0, -0.04]), 2e-6, 20e-6
PRIOR = np.array([1, 1, 1, 5e-3, 5e-3, 5e-3])


def scene(seed, count=40):
    rng = np.random.default_rng(seed)
    before = rng.uniform([-5e-3, -5e-3, 0.010], [5e-3, 5e-3, 0.011], size=(count, 3))
    after = before + [120e-6, 0, -60e-6] + np.cross([0, 0, 0.02], before) + rng.normal(size=(count, 3)) * 1e-6
    after[count // 2:] -= np.outer(rng.uniform(10e-6, 90e-6, count - count // 2), [1, 0, 0])
    normals = rng.normal((0, 0, 1), (0.2, 0.2, 0), (count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return before, after, normals, rng.normal((1, 0, 0), 0.2, (count, 3)), rng.random(count)


def equations(before, after, normals):
    """Rows and values across the rays (N, 3, 6), (N, 3), and along the normals (N, 6), (N,)."""
    rays = (before + after) / 2 - ORIGIN
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    offset = (before + after) / 2 - after.mean(axis=0)
    turns = np.stack([np.cross(axis, offset) for axis in np.eye(3)], axis=2)
    rows = np.concatenate([np.tile(np.eye(3), (len(before), 1, 1)), turns], axis=2)
    across = np.eye(3) - rays[:, :, None] * rays[:, None]
    moved = after - before
    return across @ rows, (across @ moved[:, :, None])[:, :, 0], (normals[:, None] @ rows)[:, 0], (normals * moved).sum(axis=1)


def least_squares(parts, carried, touching, expected, hold):
    rows, values, normal_rows, normal_values = parts
    lines = [np.repeat(np.sqrt(carried), 3)[:, None] * rows.reshape(-1, 6), ACROSS / ALONG * np.sqrt(touching)[:, None] * normal_rows,
             np.diag(np.sqrt(hold) * PRIOR), np.diag(np.sqrt(1e-4) * PRIOR)]
    right = [np.repeat(np.sqrt(carried), 3) * values.ravel(), ACROSS / ALONG * np.sqrt(touching) * normal_values,
             np.sqrt(hold) * PRIOR * expected, np.zeros(6)]
    return np.linalg.lstsq(np.concatenate(lines), np.concatenate(right), rcond=None)[0]


def reference(before, after, normals, drag, weights, start, hold):
    parts = equations(before, after, normals)
    twist = least_squares(parts, weights, np.ones(len(before)), np.zeros(6), 0) if start is None else start
    for bound in np.geomspace(40e-6, 10e-6, 4):
        left, off = parts[1] - parts[0] @ twist, (parts[3] - parts[2] @ twist) / (3 * ALONG)
        size = np.linalg.norm(left, axis=1)
        leads = (left * drag).sum(axis=1) > 0.3 * np.linalg.norm(drag, axis=1) * size
        square = (size / bound)**2 * np.where(leads, 0.04, 1)
        twist = least_squares(parts, weights / (1 + square)**2, 1 / (1 + off**2), np.zeros(6) if start is None else start,
                              0 if start is None else hold)
    return twist


@pytest.mark.parametrize('seed', range(5))
@pytest.mark.parametrize('start', [None, np.array([100e-6, 0, -60e-6, 0, 0, 0.02])], ids=['fresh', 'continued'])
def test_a_motion_is_that_of_stacked_equations(seed, start):
    before, after, normals, drag, weights = scene(seed)
    found = _core.fit_motion(before, after, normals, ORIGIN, np.zeros(6) if start is None else start, drag, weights, across=ACROSS,
                             along=ALONG, coarse=40e-6, fine=10e-6, hold=3.0, fresh=start is None)
    np.testing.assert_allclose(found / PRIOR**-1, reference(before, after, normals, drag, weights, start, 3.0) / PRIOR**-1, atol=1e-9)


def test_residuals_are_what_the_motion_leaves():
    before, after, normals, _, _ = scene(7)
    twist = np.random.default_rng(1).normal(size=6) * 1e-4
    across, along = _core.motion_residuals(before, after, normals, ORIGIN, twist)
    rows, values, normal_rows, normal_values = equations(before, after, normals)
    np.testing.assert_allclose(across, values - rows @ twist, atol=1e-12)
    np.testing.assert_allclose(along, normal_values - normal_rows @ twist, atol=1e-12)


def test_numbers_are_checked_and_no_dots_move_nothing():
    nothing = np.zeros((0, 3))
    given = {'across': ACROSS, 'along': ALONG, 'coarse': 4e-5, 'fine': 1e-5, 'hold': 3.0, 'fresh': False}
    found = _core.fit_motion(nothing, nothing, nothing, ORIGIN, np.full(6, 1e-3), nothing, np.zeros(0), **given)
    np.testing.assert_allclose(found, 1e-3, rtol=1e-3)
    with pytest.raises(ValueError, match='^along: '):
        _core.fit_motion(nothing, nothing, nothing, ORIGIN, np.zeros(6), nothing, np.zeros(0), **given | {'along': 0.0})
