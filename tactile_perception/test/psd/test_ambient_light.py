# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.psd.ambient_light import ProximityDetector, AmbientStepDetector, ContactDetector, hysteresis
from tactile_perception.psd.geometry import MIX, TOTAL

SIGMA, PERIOD = 0.02, 1e-3
RNG = np.random.default_rng(0)


def noise(count):
    return RNG.normal(0, SIGMA, count)


def watched(total, size):
    """(near (N,), samples of ambient steps) for totals given in batches of that size; steps are subtracted."""
    detector, near, steps, base, begin = ProximityDetector(), [], [], 0.0, 0
    while begin < len(total):
        state = detector.process(total[begin:begin + size] - base, SIGMA, PERIOD)
        near += state.near.tolist()
        begin += len(state.near)
        if state.ambient_step:
            steps.append(begin)
            base += np.mean(total[begin - 10:begin] - base)
    return np.array(near), steps


def test_hysteresis():
    on, off = np.array([0, 0, 1, 0, 0, 0, 1], bool), np.array([0, 0, 0, 0, 1, 0, 0], bool)
    assert hysteresis(on, off, False).tolist() == [False, False, True, True, False, False, True]
    assert hysteresis(on & False, off, True).tolist() == [True] * 4 + [False] * 3
    assert hysteresis(on | True, off & False, False).all()


@pytest.mark.parametrize('size', [1, 5, 64, 2000])
@pytest.mark.parametrize('light', [0.2, 1.0, 4.0])
def test_an_ambient_step_is_detected_within_20_ms_and_is_no_object(size, light):
    total = noise(2000)
    total[1000:] += light
    total[1500:] += light
    near, steps = watched(total, size)
    assert not near.any()
    assert np.array(steps) == pytest.approx([1020, 1520], abs=2)


@pytest.mark.parametrize('size', [1, 5, 64, 2000])
def test_an_object_that_rises_is_detected_at_once(size):
    total = noise(2000)
    total[1000:1010] += np.linspace(0, 0.3, 10)
    total[1010:1500] += 0.3 + 1e-3 * np.arange(490)
    near, steps = watched(total, size)
    assert steps == [] and 1001 < near.argmax() < 1010 and near[1010:1500].all() and not near[1510:].any()


def test_a_sudden_tap_is_detected_as_soon_as_it_grows():
    total = noise(1000)
    total[500:700] += np.minimum(0.3 + 0.15 * np.arange(200), 3.0)
    near, steps = watched(total, 5)
    assert steps == [] and 500 <= near.argmax() <= 504


def test_a_single_spike_is_rejected():
    total = noise(1000)
    total[500] += 3.0
    near, steps = watched(total, 50)
    assert not near.any() and steps == []


SIGMA_STEPS, PERIOD_STEPS, FLOOR = 0.02, 1e-3, 0.2
LIGHT, AMBIENT = np.array([0.5, 0.9, 0.8, 0.4]), np.array([0.10, 0.12, 0.05, 0.03])


def touched(count, seed=0):
    return LIGHT + np.random.default_rng(seed).normal(0, SIGMA_STEPS / 2, (count, 4))


def found(volts, size, period=PERIOD_STEPS):
    """(sample, change (4,)) of the steps in volts given in batches of that size."""
    watch, steps = AmbientStepDetector(), []
    for begin in range(0, len(volts), size):
        step = watch.find(volts[begin:begin + size] @ MIX, FLOOR, SIGMA_STEPS, period)
        if step is not None:
            steps.append((begin + step[0], step[1]))
    return steps


@pytest.mark.parametrize('size', [1, 5, 100, 1000])
@pytest.mark.parametrize('sign', [1, -1])
def test_an_ambient_step_during_a_contact_is_detected_with_its_size(size, sign):
    volts = touched(1000)
    volts[500:] += sign * AMBIENT
    (place, change), = found(volts, size)
    assert 500 < place <= 508
    assert MIX @ change / 4 == pytest.approx(sign * AMBIENT, abs=0.02)


@pytest.mark.parametrize('slope', [0.001, 0.01, 0.03, 0.1, 0.4])
def test_light_of_an_object_is_no_step(slope):
    for seed in range(5):
        ramp = np.clip(slope * (np.arange(1000) - 400), 0, 2.0)
        assert found(touched(1000, seed) * (1 + ramp)[:, None], 50) == []


def test_without_an_object_or_between_slow_samples_there_is_no_step():
    volts = touched(1000)
    volts[500:] += AMBIENT
    assert found(volts, 50, 0.01) == []
    dark = volts - LIGHT
    assert found(dark, 50) == []
    assert (dark @ MIX)[600:, TOTAL].mean() > 0.25


SIGMA_TOUCH, PERIOD_TOUCH = 0.02, 1e-3


def press():
    """Light that rises slowly to touch, 0.3 V after 300 ms, then strongly, and back."""
    up = np.r_[np.linspace(0, 0.3, 300), 0.3 + 0.05 * np.arange(60)]
    return np.r_[np.zeros(500), up, np.full(200, up[-1]), up[::-1], np.zeros(300)] + np.random.default_rng(0).normal(0, SIGMA_TOUCH, 1720)


@pytest.mark.parametrize('size', [1, 7, 5000])
def test_contact_begins_and_ends_where_the_waveguide_is_touched(size):
    decision, total, contact = ContactDetector(), press(), []
    for k in range(0, len(total), size):
        some = total[k:k + size]
        contact += decision.process(some, np.full(len(some), 0.3), SIGMA_TOUCH, PERIOD_TOUCH)[0].tolist()
    edges = np.flatnonzero(np.diff(np.array(contact, int)))
    assert len(edges) == 2 and abs(edges[0] - 800) <= 15 and abs(edges[1] - 1120) <= 15  # 1 mV a sample


def test_without_a_known_level_whatever_is_near_touches():
    contact, _ = ContactDetector().process(press(), None, SIGMA_TOUCH, PERIOD_TOUCH)
    assert 550 < contact.argmax() < 660 and contact[700:1200].all()


def test_levels_below_the_noise_are_ignored():
    total = np.random.default_rng(1).normal(0, SIGMA_TOUCH, 200_000)
    assert not ContactDetector().process(total, np.full(len(total), 0.001), SIGMA_TOUCH, PERIOD_TOUCH)[0].any()
