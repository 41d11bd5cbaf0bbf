# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import copy

import numpy as np
import pytest
from tactile_perception.psd.drift import DriftFilter

NOISE, STEP = 2.5e-3, 0.02  # V, of the mean of a step; s


def followed(truth, seed=0, fastest=0.025):
    """The filter after outputs with these true offsets (N,), V, a step apart."""
    rng = np.random.default_rng(seed)
    drift = DriftFilter(np.full(4, truth[0]), NOISE**2, fastest)
    for now in truth[1:]:
        drift.correct(now + rng.normal(0, NOISE, 4) - drift.offset, NOISE**2, STEP)
    return drift


def test_a_calm_room_is_averaged_over_seconds():
    errors = [followed(np.full(200, 0.1), seed).offset - 0.1 for seed in range(20)]
    assert np.sqrt(np.mean(np.square(errors))) < 0.25 * NOISE


def test_an_even_drift_is_followed_without_lag_and_goes_on_unseen():
    errors = []
    for seed in range(20):
        drift = followed(0.1 + 0.02 * STEP * np.arange(200), seed)
        drift.predict(0.3)
        errors.append(drift.offset - (0.1 + 0.02 * (199.5 * STEP + 0.3)))
    assert np.abs(np.mean(errors)) < 1e-3 and np.sqrt(np.mean(np.square(errors))) < NOISE


def test_a_drift_that_turns_is_followed():
    time = STEP * np.arange(400)
    truth = 0.1 + 0.03 * np.sin(2 * np.pi * time / 6)
    assert followed(truth).offset == pytest.approx(np.full(4, truth[-1]), abs=1.5 * NOISE)


def lamp(seconds, dark):
    """Outputs (N, 4), V, of a lamp whose light swings, with dark voltages, and the direction in which it swings."""
    time, way = STEP * np.arange(int(seconds / STEP)), np.array([0.15, 0.25, 0.4, 0.3])
    return dark + (1 + 0.1 * np.sin(2 * np.pi * time / 6))[:, None] * way, way / np.linalg.norm(way)


def test_across_the_light_of_a_room_that_changes_it_is_averaged_over_seconds():
    truth, way = lamp(5.0, 0.03)
    errors = np.array([followed(truth, seed).offset - truth[-1] for seed in range(20)])
    across = errors - (errors @ way)[:, None] * way
    assert np.sqrt((across**2).sum(1).mean() / 3) < 0.2 * NOISE
    assert np.sqrt(np.mean((errors @ way) ** 2)) < 1.5 * NOISE


def test_the_way_in_which_a_room_changes_is_learnt_where_its_outputs_hold_voltages_that_do_not_change():
    truth, way = lamp(12.0, np.array([0.12, 0.02, 0.02, 0.12]))
    errors = np.array([followed(truth[:count], seed).offset - truth[count - 1] for seed in range(5) for count in (450, 525, 600)])
    across = errors - (errors @ way)[:, None] * way
    assert np.sqrt((across**2).sum(1).mean() / 3) < 0.22 * NOISE


@pytest.mark.parametrize('swings', [False, True])
def test_the_variances_are_those_of_the_errors(swings):
    truth, way = lamp(3.0, 0.0)
    truth = truth if swings else np.tile(truth[:1], (100, 1))
    drifts = [followed(truth, seed) for seed in range(60)]
    errors = np.array([drift.offset - truth[-1] for drift in drifts])
    along = errors @ way
    squares = np.mean(along**2), np.mean(((errors**2).sum(1) - along**2) / 3)
    for square, variance in zip(squares, np.mean([drift.variances for drift in drifts], axis=0)):
        assert 0.5 < square / variance < 2


def test_it_is_moved_and_a_copy_is_not():
    drift = followed(np.full(50, 0.1))
    before, offset = copy.copy(drift), drift.offset
    drift.move(np.full(4, 0.5))
    assert drift.offset == pytest.approx(offset + 0.5) and (before.offset == offset).all()
    drift.restart(1.0)
    drift.correct(np.full(4, 0.2), 1e-6, STEP)
    assert drift.offset == pytest.approx(offset + 0.7, abs=1e-3) and (before.offset == offset).all()
