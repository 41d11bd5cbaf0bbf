# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.taxel.hysteresis import Hysteresis, fit_loop, shown

WIDTH, RELAXATION, STEP_S = 2e3, 0.5, 0.01


def seen_and_true():
    """What a layer shows, and its load: up, held, half way down, up again, off."""
    times = np.arange(0, 6, STEP_S)
    loads = np.interp(times, [0, 0.5, 1.5, 2.5, 3.0, 4.0, 4.2, 6.0], [0, 0, 5e4, 5e4, 2e4, 4e4, 0, 0])
    return times, loads, shown(loads, np.full(len(times), STEP_S), WIDTH, RELAXATION)


def test_a_layer_follows_a_load_with_half_of_the_loop_between_and_creeps_to_one_that_rests():
    _, loads, seen = seen_and_true()
    assert loads[140] - seen[140] == pytest.approx(WIDTH, rel=0.02) and seen[295] - loads[295] == pytest.approx(WIDTH, rel=0.03)
    assert abs(loads[250] - seen[250]) < 0.2 * WIDTH


def test_play_is_undone_where_the_load_keeps_its_direction():
    _, loads, seen = seen_and_true()
    undo = Hysteresis(WIDTH, RELAXATION)
    found = np.array([undo.undone(np.full((3, 3), value, np.float32), STEP_S)[1, 1] for value in seen])
    before, after = np.abs(seen - loads), np.abs(found - loads)
    assert after.mean() < 0.4 * before.mean() and after[[140, 295, 395]].max() < 0.1 * WIDTH


def test_noise_stays_below_its_double_and_a_width_of_0_changes_nothing():
    rng, undo = np.random.default_rng(0), Hysteresis(WIDTH, RELAXATION)
    frames = rng.normal(1e4, 300, (60, 20, 20)).astype(np.float32)
    found = np.array([undo.undone(frame, STEP_S) for frame in frames])
    assert found[20:].std() < 2 * 300
    assert (Hysteresis(0.0, 1.0).undone(frames[0], STEP_S) == frames[0]).all()


def test_width_and_relaxation_are_fitted_and_no_loop_is_seen_in_noise():
    times, loads, seen = seen_and_true()
    terms, weights = np.stack([seen, seen**2 * 1e-5], axis=1), np.where(loads > 0, 1e-4, 0)
    width, relaxation = fit_loop(times, loads, terms, weights)
    assert width == pytest.approx(WIDTH, rel=0.2) and relaxation == pytest.approx(RELAXATION, rel=0.3)
    noisy = loads + np.random.default_rng(0).normal(0, 500, len(loads))
    assert fit_loop(times, loads, np.maximum(noisy, 0)[:, None], weights) == (0.0, 1.0)
