# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.errors import BadArgument
from tactile_perception.psd.baseline import Reference
from tactile_perception.psd.geometry import MIX

OFFSET = np.array([0.10, 0.13, 0.12, 0.09])


def rest(count, rng, add=0.0):
    return OFFSET + np.asarray(add)[..., None] / 4 + rng.normal(0, 0.01, (count, 4))


def taken(rng, seconds=0.2):
    reference = Reference(seconds, 0.1)
    assert reference.take(rest(500, rng), 1e-3) == round(seconds * 1000)
    assert reference.ready
    return reference


def follow(reference, volts, size=10):
    for k in range(0, len(volts), size):
        reference.follow((volts[k:k + size] - reference.offset) @ MIX, 1e-3)


def test_offset_and_noise_are_measured():
    reference = taken(np.random.default_rng(0))
    assert reference.offset == pytest.approx(OFFSET, abs=3e-3)
    assert reference.sigma == pytest.approx(0.02, rel=0.15)
    assert reference.noise == pytest.approx(1e-4 * MIX.T @ MIX, abs=1.5e-4)


def test_it_is_measured_over_several_calls():
    rng, reference = np.random.default_rng(0), Reference(0.05, 0.1)
    for k in range(9):
        assert reference.take(rest(5, rng), 1e-3) == 5 and not reference.ready
    assert reference.take(rest(100, rng), 1e-3) == 5 and reference.ready


def test_a_contact_during_the_measurement_is_rejected():
    rng, reference = np.random.default_rng(0), Reference(0.2, 0.1)
    volts = rest(200, rng)
    volts[150:] += 0.5
    reference.take(volts, 1e-3)
    assert reference.offset == pytest.approx(OFFSET, abs=5e-3)


def test_drift_is_tracked_and_an_approaching_object_is_not():
    rng = np.random.default_rng(0)
    reference = taken(rng)
    drift = 0.05 * np.arange(10_000) / 1000
    follow(reference, rest(10_000, rng, drift))
    assert reference.offset.sum() == pytest.approx(OFFSET.sum() + 0.5, abs=0.05)
    reference = taken(rng)
    follow(reference, rest(300, rng, np.arange(300) / 1000))
    assert reference.offset.sum() == pytest.approx(OFFSET.sum(), abs=0.04)


def test_falling_light_is_tracked_at_once_and_constant_light_after_a_while():
    rng = np.random.default_rng(0)
    reference = taken(rng)
    follow(reference, rest(150, rng, -0.3))
    assert reference.offset.sum() == pytest.approx(OFFSET.sum() - 0.3, abs=0.02)
    reference = taken(rng)
    follow(reference, rest(150, rng, 0.3))
    assert reference.offset.sum() < OFFSET.sum() + 0.05
    follow(reference, rest(150, rng, 0.3))
    assert reference.offset.sum() == pytest.approx(OFFSET.sum() + 0.3, abs=0.03)


def test_an_object_that_comes_near_and_goes_leaves_the_offset_of_a_calm_room_alone():
    errors, told = [], []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        reference = taken(rng)
        for _ in range(8):  # presses: it is near for 15 ms before and after, up to 0.3 V
            near = 0.3 * np.linspace(0, 1, 15) ** 2.6
            follow(reference, np.concatenate([rest(rng.integers(150, 190), rng), rest(15, rng, near)]))
            reference.recall()
            errors.append(reference.offset.sum() - OFFSET.sum())
            told.append(reference.uncertainty)
            for _ in range(30):
                reference.hold(0.01)
            follow(reference, rest(15, rng, near[::-1]))
    assert np.abs(np.mean(errors)) < 6e-4 and np.sqrt(np.mean(np.square(errors))) < 2e-3
    assert 0.5 < np.mean(np.square(errors)) / np.mean(np.square(told)) < 2


def test_flicker_of_lamps_is_averaged_over_whole_periods():
    reference, errors = Reference(0.2, 0.1), []
    volts = OFFSET + 0.025 * np.sin(200 * np.pi * np.arange(3000) / 1000)[:, None]
    reference.take(volts[:200], 1e-3)
    for k in range(200, 2900, 7):
        follow(reference, volts[k:k + 7])
        errors.append(reference.offset.sum() - OFFSET.sum())
    assert np.abs(errors).max() < 1e-4


def test_a_step_of_the_room_counts_where_a_contact_begins():
    rng = np.random.default_rng(2)
    reference = taken(rng)
    follow(reference, rest(200, rng))
    reference.shift(np.full(4, 0.1))
    reference.recall()
    assert reference.offset.sum() == pytest.approx(OFFSET.sum() + 0.4, abs=0.01)
    reference.shift(np.full(4, 0.1))
    assert reference.offset.sum() == pytest.approx(OFFSET.sum() + 0.8, abs=0.01)


def test_noise_is_tracked():
    rng = np.random.default_rng(0)
    reference = taken(rng)
    follow(reference, OFFSET + rng.normal(0, 0.015, (8000, 4)))
    assert reference.sigma == pytest.approx(0.03, rel=0.15)


def test_bad_arguments():
    with pytest.raises(BadArgument):
        Reference(0.0, 0.1)
