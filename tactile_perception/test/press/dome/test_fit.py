# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest
from dome_library import inverse, library_field, press
from tactile_perception.press.dome.fit import DEPTH, DRAGGED, STRAIGHT, UNKNOWN_FRICTION

pytestmark = pytest.mark.full  # simulates a small library
PRESS = press(0.022, -0.031, 0.021, 0.3, 0.2, (0.1, -0.05))


def test_a_press_is_found_with_an_honest_covariance():
    squares = []
    for seed in range(20):
        field = library_field(PRESS, seed=seed)
        found = inverse().solve(field, inverse().start(inverse().match(field)), DRAGGED)
        off = found.presses[0] - PRESS
        squares.append(off[:3] @ np.linalg.solve(found.covariance[:3, :3], off[:3]) / 3)
        assert np.hypot(*off[:2]) < 1.5e-3 and abs(off[DEPTH]) < 0.1 and found.misfit < 1.5
    assert 0.1 < np.mean(squares) < 2, 'the press lies well within the prior'


@pytest.mark.parametrize('reported, least, most', [(STRAIGHT, 0.3, 2.0), (replace(STRAIGHT, rougher=0.0), 2.5, np.inf)])
def test_a_straight_press_may_have_any_friction_and_the_covariance_says_so(reported, least, most):
    squares = []
    for seed, number in enumerate(np.random.default_rng(3).normal(0, UNKNOWN_FRICTION, 30)):
        true = press(0.022, -0.031, 0.021, 0.3, number)
        found = inverse().solve(library_field(true, seed=seed), true[None], reported)
        squares.append((found.presses[0, DEPTH] - true[DEPTH])**2 / found.covariance[DEPTH, DEPTH])
    assert least < np.mean(squares) < most


def test_two_presses_are_found_from_the_best_pair_of_starts():
    two = press(0.045, 0.02, 0.02), press(-0.04, -0.01, 0.018)
    found = inverse().solve(library_field(*two), inverse().start_of_two(inverse().match(library_field(*two))))
    places = found.presses[np.argsort(-found.presses[:, 0])]
    assert np.abs(places[:, :2] - np.array(two)[:, :2]).max() < 2e-3 and found.misfit < 1.5


def test_markers_that_are_not_seen_do_not_count():
    field = library_field(PRESS)
    field.shift[::3] = np.nan
    found = inverse().solve(field, inverse().start(inverse().match(field)))
    assert np.hypot(*(found.presses[0] - PRESS)[:2]) < 2e-3
    assert found.misfit < 1.5


def test_untouched_frames_match_no_start():
    def score(field):
        return inverse().score(field, inverse().match(field))

    assert max(score(library_field(seed=seed)) for seed in range(50)) < 6 < 50 < score(library_field(PRESS))
