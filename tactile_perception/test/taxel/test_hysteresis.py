# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument
from tactile_perception.taxel.calibration import fit_loop
from tactile_perception.taxel.response import Hysteresis, Loop

STEP_S = 0.01
HARD, SOFT, GROWING = Loop(0.5, 4e3, 0.0, 0.5), Loop(0.12, 8e3, 0.0, 1.0), Loop(0.5, 500.0, 0.08, 1.0)
SLOW = Loop(0.1, 6e3, 0.0, 1.0, (0.03, 0.05), (0.1, 1.6))
LOOPS = pytest.mark.parametrize('loop', [HARD, SOFT, GROWING, SLOW])


def seen_and_true(loop):
    """Times, s, loads: up, held, half way down, up again, off; what a layer shows of them."""
    times = np.arange(0, 6, STEP_S)
    loads = np.interp(times, [0, 0.5, 1.5, 2.5, 3.0, 4.0, 4.2, 6.0], [0, 0, 5e4, 5e4, 2e4, 4e4, 0, 0])
    return times, loads, loop.shown(loads, np.full(len(times), STEP_S))


def undone(loop, seen):
    undo = Hysteresis(loop)
    return np.array([undo.undone(np.full((3, 3), value, np.float32), STEP_S)[1, 1] for value in seen])


def test_a_layer_lags_by_half_of_the_loop_and_creeps_to_a_load_that_rests():
    _, loads, seen = seen_and_true(HARD)
    half = 0.5 * HARD.width(5e4)
    assert loads[140] - seen[140] == pytest.approx(half, rel=0.05) and seen[295] - loads[295] == pytest.approx(half, rel=0.05)
    assert abs(loads[250] - seen[250]) < 0.2 * half


@LOOPS
def test_what_a_layer_hides_is_found_exactly(loop):
    _, loads, seen = seen_and_true(loop)
    found = undone(loop, seen)
    assert np.abs(seen - loads).max() > 500 and np.abs(found - loads).max() < 5


@LOOPS
def test_noise_grows_as_told(loop):
    rng, undo = np.random.default_rng(0), Hysteresis(loop)
    frames = rng.normal(1e4, 100, (200, 20, 20)).astype(np.float32)
    found = np.array([undo.undone(frame, STEP_S) for frame in frames])[50:]
    assert found.std(axis=0).mean() == pytest.approx(100 * loop.noise_gain, rel=0.15)
    assert Loop().noise_gain == 1 and (Hysteresis(Loop()).undone(frames[0], STEP_S) == frames[0]).all()


@LOOPS
def test_a_loop_is_fitted(loop):
    times, loads, seen = seen_and_true(loop)
    terms, weights = np.stack([seen, seen**2 * 1e-5], axis=1), np.where(loads > 0, 1e-4, 0)
    found = fit_loop(times, loads, terms, weights)
    assert found.width(5e4) == pytest.approx(loop.width(5e4), rel=0.25) and found.relaxation == pytest.approx(loop.relaxation, rel=0.9)
    assert sum(found.late) == pytest.approx(sum(loop.late), abs=0.01)
    again = found.shown(loads, np.full(len(times), STEP_S))
    assert np.abs(again - seen).max() < 0.3 * np.abs(seen - loads).max()


def test_no_loop_is_seen_in_noise():
    times, loads, _ = seen_and_true(HARD)
    noisy = loads + np.random.default_rng(0).normal(0, 500, len(loads))
    assert fit_loop(times, loads, np.maximum(noisy, 0)[:, None], np.where(loads > 0, 1e-4, 0)) == Loop()


def test_numbers_that_are_no_loop_are_refused():
    for numbers in ((0.95, 1.0), (-0.1, 1.0), (0.5, -1.0), (0.5, np.inf), (0.5, 1.0, 1.5), (0.5, 1.0, 0.0, 0.0), (np.nan, 1.0),
                    (0.1, 1.0, 0.0, 1.0, (0.1,)), (0.1, 1.0, 0.0, 1.0, (0.5, 0.45), (1.0, 2.0)), (0.1, 1.0, 0.0, 1.0, (0.1,), (0.0,))):
        with pytest.raises(BadArgument, match='loop'):
            Loop(*numbers)
