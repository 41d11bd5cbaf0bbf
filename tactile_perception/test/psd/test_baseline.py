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
    follow(reference, rest(300, rng, 0.3))
    assert reference.offset.sum() < OFFSET.sum() + 0.1
    follow(reference, rest(1000, rng, 0.3))
    assert reference.offset.sum() == pytest.approx(OFFSET.sum() + 0.3, abs=0.03)


def test_a_contact_begins_from_the_light_before_an_evident_shade_and_else_from_the_latest():
    rng = np.random.default_rng(2)
    for seed in range(5):
        reference = taken(rng)
        follow(reference, rest(1000, rng))
        latest = reference.offset.copy()
        reference.recall()
        assert (reference.offset == latest).all()
        follow(reference, rest(40, rng, np.full(40, -0.06)))  # an object shades an eighth
        shaded = reference.offset.sum()
        reference.recall()
        assert shaded < OFFSET.sum() - 0.03 and reference.offset.sum() == pytest.approx(OFFSET.sum(), abs=6e-3)


def test_noise_is_tracked():
    rng = np.random.default_rng(0)
    reference = taken(rng)
    follow(reference, OFFSET + rng.normal(0, 0.015, (8000, 4)))
    assert reference.sigma == pytest.approx(0.03, rel=0.15)


def test_bad_arguments():
    with pytest.raises(BadArgument):
        Reference(0.0, 0.1)
