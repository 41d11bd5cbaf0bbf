# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.taxel.breakaway import broke_away, has_stopped

LEAD, LEAST = 2.2, 4e-5


def told(speeds, rate=100.0):
    """Whether a breakaway is told after each frame of an object with such speeds, m/s, of its picture over the lead."""
    times, places = np.arange(len(speeds)) / rate, np.cumsum(speeds) / rate
    return [broke_away(times[:k + 1], places[:k + 1], LEAD, LEAST) for k in range(1, len(speeds))]


@pytest.mark.parametrize('rate', (60.0, 100.0, 500.0))
def test_a_picture_that_slows_down_by_the_lead_is_told_within_40_ms(rate):
    before, after = [3e-3] * round(0.1 * rate), [3e-3 / LEAD] * round(0.1 * rate)
    found = told(before + after, rate)
    assert not any(found[:len(before)]) and any(found[len(before):len(before) + round(0.045 * rate)])


def test_a_fast_object_is_told_within_two_frames_and_a_stop_within_a_frame_is_none():
    before, slower = [0.0] * 10 + [8e-3] * 3, 8e-3 / LEAD
    assert any(told(before + [slower] * 2)[len(before):])
    assert not any(told(before + [slower] + [0.0] * 10))


@pytest.mark.parametrize('after', (0.0, -3e-3, 2.8e-3, 3e-3, 6e-3))
def test_a_stop_a_reversal_and_a_steady_motion_are_none_once_they_last(after):
    assert not any(told([3e-3] * 12 + [after] * 12)[15:])


def test_a_slow_motion_and_a_short_past_tell_nothing():
    assert not any(told([5e-4] * 10 + [5e-4 / LEAD] * 10))
    assert not any(told([3e-3] * 4 + [3e-3 / LEAD] * 3))


def test_an_object_that_hardly_goes_on_has_stopped_unless_noise_hides_it():
    assert has_stopped(1.5e-4, 0.0, 1e-5) and has_stopped(1.5e-4, -1.5e-4, 1e-5)
    assert not has_stopped(1.5e-4, 1.5e-4, 1e-5) and not has_stopped(1.5e-4, 6e-5, 1e-5)
    assert not has_stopped(1.5e-4, 0.0, 7e-5) and not has_stopped(0.0, 0.0, 1e-5)
