# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import math

import pytest
from tactile_perception.errors import ClockSetBack
from tactile_perception.pipeline.clock import StampClock


@pytest.fixture
def clock():
    clock = StampClock()
    assert not any(clock.begins_anew(100.0 + 0.1 * k) for k in range(50))
    return clock


def test_a_recording_that_begins_again_begins_anew_with_its_second_frame(clock):
    with pytest.raises(ClockSetBack, match=r'go back by 4\.9 s'):
        clock.begins_anew(100.0)
    assert [clock.begins_anew(t) for t in (100.1, 100.2, 100.3)] == [True, False, False]


def test_one_stamp_from_the_past_changes_nothing(clock):
    with pytest.raises(ClockSetBack):
        clock.begins_anew(3.0)
    assert not clock.begins_anew(105.0)
    with pytest.raises(ClockSetBack):
        clock.begins_anew(4.0)


def test_one_stamp_from_the_future_costs_two_frames(clock):
    assert not clock.begins_anew(1e6)
    with pytest.raises(ClockSetBack):
        clock.begins_anew(105.0)
    assert clock.begins_anew(105.1)


@pytest.mark.parametrize('stamp', [104.9, math.nan, math.inf])
def test_what_repeats_or_is_no_number_is_for_others_to_judge(clock, stamp):
    assert not clock.begins_anew(stamp)
    assert not clock.begins_anew(105.0)


def test_a_frame_out_of_order_changes_nothing(clock):
    for stamp in (104.7, 104.8):
        with pytest.raises(ClockSetBack, match='go back by 0'):
            clock.begins_anew(stamp)
    assert not clock.begins_anew(105.0)
    with pytest.raises(ClockSetBack):
        clock.begins_anew(104.9)


def test_a_recording_whose_beginning_was_not_seen_begins_anew_with_its_third_frame(clock):
    for stamp in (104.2, 104.3):
        with pytest.raises(ClockSetBack):
            clock.begins_anew(stamp)
    assert clock.begins_anew(104.4)
    assert not clock.begins_anew(104.5)
