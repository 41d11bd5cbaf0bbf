# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.psd.ambient_light import ContactDetector, Light, ProximityDetector, hysteresis

SIGMA, PERIOD = 0.02, 1e-3
RNG = np.random.default_rng(0)


def noise(count):
    return RNG.normal(0, SIGMA, count)


def watched(total, size):
    """(near (N,), samples of ambient steps) for totals given in batches of that size; steps are subtracted."""
    detector, near, steps, base, begin = ProximityDetector(), [], [], 0.0, 0
    while begin < len(total):
        some = total[begin:begin + size] - base
        state = detector.process(some, some.min(), some.max(), SIGMA, PERIOD)
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


SIGMA_TOUCH, PERIOD_TOUCH = 0.02, 1e-3


def press():
    """Light that rises slowly to touch, 0.3 V after 300 ms, then strongly, and back."""
    up = np.r_[np.linspace(0, 0.3, 300), 0.3 + 0.05 * np.arange(60)]
    return np.r_[np.zeros(500), up, np.full(200, up[-1]), up[::-1], np.zeros(300)] + np.random.default_rng(0).normal(0, SIGMA_TOUCH, 1720)


def contacts(total, level, size=5000):
    """Whether each sample is in contact, where contact begins at a light of level, at least four standard deviations."""
    detector, found = ContactDetector(), []
    for k in range(0, len(total), size):
        some = total[k:k + size]
        over = np.where(some > 3 * SIGMA_TOUCH, some - max(level, 4 * SIGMA_TOUCH), -np.inf)
        found += detector.process(Light(some, over, some.min(), some.max(), over.min()), SIGMA_TOUCH, PERIOD_TOUCH)[0].tolist()
    return np.array(found)


@pytest.mark.parametrize('size', [1, 7, 5000])
def test_contact_begins_and_ends_where_the_waveguide_is_touched(size):
    edges = np.flatnonzero(np.diff(contacts(press(), 0.3, size).astype(int)))
    assert len(edges) == 2 and abs(edges[0] - 800) <= 15 and abs(edges[1] - 1120) <= 15  # 1 mV a sample


def test_without_a_known_level_whatever_is_near_touches():
    contact = contacts(press(), 0.0)
    assert 550 < contact.argmax() < 660 and contact[700:1200].all()


def test_levels_below_the_noise_are_ignored():
    assert not contacts(np.random.default_rng(1).normal(0, SIGMA_TOUCH, 200_000), 0.001).any()


def test_light_that_is_there_after_missing_samples_is_an_objects():
    total = noise(1000)
    total[500:] += 1.0
    detector = ProximityDetector()
    assert not detector.process(total[:500], total[:500].min(), total[:500].max(), SIGMA, PERIOD).near.any()
    detector.interrupt()
    assert detector.process(total[500:], total[500:].min(), total[500:].max(), SIGMA, PERIOD).near[5:].all()


@pytest.mark.parametrize('light, goes_on', [(0.28, False), (0.4, True)])
def test_a_contact_goes_on_after_missing_samples_only_if_the_next_one_shows_it(light, goes_on):
    detector = ContactDetector()

    def contact(total):
        light = Light(total, total - 0.3, total.min(), total.max(), (total - 0.3).min())
        return detector.process(light, SIGMA, PERIOD)[0]
    contact(np.r_[np.zeros(10), np.linspace(0, 1, 20)])
    assert contact(np.full(1, 0.28)).all(), 'without missing samples it does'
    detector.interrupt()
    assert detector.touching and contact(np.full(1, light)).all() == goes_on == detector.touching
