# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
from tactile_perception.touchpad.contact.twist_fit import DotMotions, twist_about

ORIGIN = np.array([0.0, 0.0, -0.04])
UP = np.tile([0.0, 0.0, 1.0], (60, 1))


def _turn(angle):
    return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])


def _patch(count=60, seed=0):
    return np.random.default_rng(seed).uniform([-5e-3, -5e-3, 0.0105], [5e-3, 5e-3, 0.011], size=(count, 3))


def test_a_large_turn_and_shift_are_exact():
    before = _patch()
    after = before @ _turn(0.3).T + [1e-3, -2e-3, 0.5e-3]
    motions = DotMotions(before, after, UP[:len(before)], ORIGIN, 2e-6, 20e-6)
    twist = motions.fit_robust(None, 0 * before, 1.0, 1.0, 0.0, np.ones(60))
    assert abs(twist[5] - 2 * np.tan(0.15)) < 1e-4
    assert np.abs(motions.residuals(twist)).max() < 0.1e-6 and np.abs(motions.normal_residuals(twist)).max() < 0.5e-6


def test_a_twist_about_another_point_is_the_same_motion():
    before = _patch()
    after = before + np.cross([0, 0, 1e-3], before) + [1e-5, 0, 0]
    one = DotMotions(before, after, UP[:len(before)], ORIGIN, 2e-6, 20e-6)
    other = DotMotions(before[:20], after[:20], UP[:20], ORIGIN, 2e-6, 20e-6)
    found = one.fit_robust(None, 0 * before, 1.0, 1.0, 0.0, np.ones(60))
    assert np.abs(other.residuals(twist_about(found, one.centre, other.centre))).max() < 2e-9


def test_the_few_that_are_carried_are_followed_while_the_rest_lags():
    before, rng = _patch(), np.random.default_rng(1)
    after = before + [150e-6, 0, 0] + rng.normal(size=(60, 3)) * 1e-6
    after[15:] -= np.outer(rng.uniform(15e-6, 60e-6, 45), [1, 0, 0])
    motions = DotMotions(before, after, UP[:len(before)], ORIGIN, 2e-6, 20e-6)
    start = np.array([145e-6, 0, 0, 0, 0, 0])
    drag = np.tile([1.0, 0, 0], (60, 1))
    twist = motions.fit_robust(start, drag, 40e-6, 10e-6, 2.0, np.ones(60))
    lag = np.linalg.norm(motions.residuals(twist), axis=1)
    assert lag[:15].max() < 8e-6
    assert np.median(lag[15:]) > 25e-6
