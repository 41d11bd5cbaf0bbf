# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.psd.signals import MIX, TOTAL
from tactile_perception.psd.steps import StepWatch

SIGMA, PERIOD, FLOOR = 0.02, 1e-3, 0.2
LIGHT, LAMP = np.array([0.5, 0.9, 0.8, 0.4]), np.array([0.10, 0.12, 0.05, 0.03])


def touched(count, seed=0):
    return LIGHT + np.random.default_rng(seed).normal(0, SIGMA / 2, (count, 4))


def found(volts, size, period=PERIOD):
    """(place, change (4,)) of the steps in volts given in portions."""
    watch, steps = StepWatch(), []
    for begin in range(0, len(volts), size):
        step = watch.find(volts[begin:begin + size] @ MIX, FLOOR, SIGMA, period)
        if step is not None:
            steps.append((begin + step[0], step[1]))
    return steps


@pytest.mark.parametrize('size', [1, 5, 100, 1000])
@pytest.mark.parametrize('sign', [1, -1])
def test_a_lamp_switched_during_a_touch_is_found_with_its_light(size, sign):
    volts = touched(1000)
    volts[500:] += sign * LAMP
    (place, change), = found(volts, size)
    assert 500 < place <= 508
    assert MIX @ change / 4 == pytest.approx(sign * LAMP, abs=0.02)


@pytest.mark.parametrize('slope', [0.001, 0.01, 0.03, 0.1, 0.4])
def test_light_that_an_object_brings_is_no_step(slope):
    for seed in range(5):
        ramp = np.clip(slope * (np.arange(1000) - 400), 0, 2.0)
        assert found(touched(1000, seed) * (1 + ramp)[:, None], 50) == []


def test_without_an_object_or_between_slow_samples_nothing_is_told():
    volts = touched(1000)
    volts[500:] += LAMP
    assert found(volts, 50, 0.01) == []
    dark = volts - LIGHT
    assert found(dark, 50) == []
    assert (dark @ MIX)[600:, TOTAL].mean() > 0.25
