# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from dome_library import inverse, library_field, press
from tactile_perception.press.dome.model import DEPTH, DRAGGED, STRAIGHT, UNKNOWN_FRICTION

pytestmark = pytest.mark.full  # simulates a small library
PRESS = press(0.022, -0.031, 0.021, 0.3, -0.2, (0.1, -0.05))


def test_a_press_is_found_with_an_honest_covariance():
    squares = []
    for seed in range(20):
        field = library_field(PRESS, seed=seed)
        found = inverse().solve(field, inverse().start(inverse().match(field)), DRAGGED)
        off = found.presses[0] - PRESS
        squares.append(off[:3] @ np.linalg.solve(found.covariance[:3, :3], off[:3]) / 3)
        assert np.hypot(*off[:2]) < 1.5e-3 and abs(off[DEPTH]) < 0.1 and found.misfit < 1.5
    assert 0.1 < np.mean(squares) < 2, 'the press lies well within the prior'


def test_a_straight_press_may_have_any_friction_and_the_covariance_says_so():
    squares = []
    for seed, number in enumerate(-np.abs(np.random.default_rng(3).normal(0, UNKNOWN_FRICTION, 30))):
        true = press(0.022, -0.031, 0.021, 0.3, number)
        found = inverse().solve(library_field(true, seed=seed), true[None], STRAIGHT)
        squares.append((found.presses[0, DEPTH] - true[DEPTH])**2 / found.covariance[DEPTH, DEPTH])
    assert 0.3 < np.mean(squares) < 2.0
