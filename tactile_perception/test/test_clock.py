# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import math

import pytest
from tactile_perception.errors import BadFrame, ClockSetBack
from tactile_perception.clock import StampClock


@pytest.fixture
def clock():
    clock = StampClock()
    assert not any(clock.begins_anew(100.0 + 0.1 * k) for k in range(50))
    return clock


def test_a_recording_that_loops_restarts_with_its_second_frame(clock):
    with pytest.raises(ClockSetBack, match=r'go back by 4\.9 s'):
        clock.begins_anew(100.0)
    assert [clock.begins_anew(t) for t in (100.1, 100.2, 100.3)] == [True, False, False]


def test_one_stamp_from_the_past_has_no_effect(clock):
    with pytest.raises(ClockSetBack):
        clock.begins_anew(3.0)
    assert not clock.begins_anew(105.0)
    with pytest.raises(ClockSetBack):
        clock.begins_anew(4.0)


def test_one_stamp_from_the_future_has_no_effect(clock):
    for stamp in (1e6, 2e9, 3e5):
        with pytest.raises(ClockSetBack, match='ahead'):
            clock.begins_anew(stamp)
    assert not clock.begins_anew(105.0)
    with pytest.raises(ClockSetBack, match='ahead'):
        clock.begins_anew(1e6)


def test_after_a_pause_of_an_hour_the_second_frame_is_accepted(clock):
    with pytest.raises(ClockSetBack, match='ahead'):
        clock.begins_anew(4000.0)
    assert [clock.begins_anew(t) for t in (4000.1, 4000.2)] == [False, False]


def test_a_frame_that_is_refused_leaves_no_stamp(clock):
    for error in (BadFrame, IndexError):
        with pytest.raises(error), clock.at(2000.0) as anew:
            assert not anew
            raise error('the picture is black')
    with clock.at(105.0) as anew:
        assert not anew
    with pytest.raises(ClockSetBack), clock.at(50.0):
        pass
    for _ in range(2):
        with pytest.raises(BadFrame), clock.at(50.1) as anew:
            assert anew
            raise BadFrame('the picture is black')
    with clock.at(50.1) as anew:
        assert anew


@pytest.mark.parametrize('stamp', [104.9, math.nan, math.inf])
def test_repeated_and_invalid_stamps_are_left_to_the_stage(clock, stamp):
    assert not clock.begins_anew(stamp)
    assert not clock.begins_anew(105.0)


def test_frames_out_of_order_have_no_effect(clock):
    for stamp in (104.7, 104.8):
        with pytest.raises(ClockSetBack, match='go back by 0'):
            clock.begins_anew(stamp)
    assert not clock.begins_anew(105.0)
    with pytest.raises(ClockSetBack):
        clock.begins_anew(104.9)


def test_a_step_back_of_less_than_a_second_restarts_with_the_third_frame(clock):
    for stamp in (104.2, 104.3):
        with pytest.raises(ClockSetBack):
            clock.begins_anew(stamp)
    assert clock.begins_anew(104.4)
    assert not clock.begins_anew(104.5)
