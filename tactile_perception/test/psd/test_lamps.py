# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.psd.lamps import LampWatch, held

SIGMA, PERIOD = 0.02, 1e-3
RNG = np.random.default_rng(0)


def noise(count):
    return RNG.normal(0, SIGMA, count)


def watched(total, size):
    """(near (N,), where lamps were told) of totals that are given in portions; a lamp's light is taken off."""
    watch, near, lamps, base, begin = LampWatch(), [], [], 0.0, 0
    while begin < len(total):
        seen = watch.process(total[begin:begin + size] - base, SIGMA, PERIOD)
        near += seen.near.tolist()
        begin += len(seen.near)
        if seen.lamp:
            lamps.append(begin)
            base += np.mean(total[begin - 10:begin] - base)
    return np.array(near), lamps


def test_states_are_held():
    on, off = np.array([0, 0, 1, 0, 0, 0, 1], bool), np.array([0, 0, 0, 0, 1, 0, 0], bool)
    assert held(on, off, False).tolist() == [False, False, True, True, False, False, True]
    assert held(on & False, off, True).tolist() == [True] * 4 + [False] * 3
    assert held(on | True, off & False, False).all()


@pytest.mark.parametrize('size', [1, 5, 64, 2000])
@pytest.mark.parametrize('light', [0.2, 1.0, 4.0])
def test_a_lamp_is_told_within_20_ms_and_is_no_object(size, light):
    total = noise(2000)
    total[1000:] += light
    total[1500:] += light
    near, lamps = watched(total, size)
    assert not near.any()
    assert np.array(lamps) == pytest.approx([1020, 1520], abs=2)


@pytest.mark.parametrize('size', [1, 5, 64, 2000])
def test_an_object_that_rises_is_told_at_once(size):
    total = noise(2000)
    total[1000:1010] += np.linspace(0, 0.3, 10)
    total[1010:1500] += 0.3 + 1e-3 * np.arange(490)
    near, lamps = watched(total, size)
    assert lamps == [] and 1001 < near.argmax() < 1010 and near[1010:1500].all() and not near[1510:].any()


def test_a_sudden_tap_is_told_as_soon_as_it_grows():
    total = noise(1000)
    total[500:700] += np.minimum(0.3 + 0.15 * np.arange(200), 3.0)
    near, lamps = watched(total, 5)
    assert lamps == [] and 500 <= near.argmax() <= 504


def test_a_spark_is_nothing():
    total = noise(1000)
    total[500] += 3.0
    near, lamps = watched(total, 50)
    assert not near.any() and lamps == []
