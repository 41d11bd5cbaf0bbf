# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument, BadFrame
from tactile_perception.press.estimate import TouchEstimate
from tactile_perception.press.estimator import TouchTracker

SIGMA = 1e-4


def touch(x, y, depth=2e-3, sigma=SIGMA):
    return TouchEstimate(np.array([x, y, -depth]), depth, sigma**2 * np.eye(3), sigma)


def test_two_touches_keep_their_numbers_whatever_their_order():
    tracker = TouchTracker()
    for k in range(20):
        left, right = touch(-0.01 + 1e-4 * k, 0.0), touch(0.01 - 1e-4 * k, 0.0)
        assert tracker.process([right, left] if k % 2 else [left, right], 0.03 * k) == ([2, 1] if k % 2 else [1, 2])


def test_a_touch_that_ended_gives_its_number_to_no_other_one():
    tracker = TouchTracker()
    assert tracker.process([touch(0.0, 0.0)], 0.0) == [1]
    for k in range(1, 6):
        assert tracker.process([], 0.03 * k) == []
    assert tracker.process([touch(0.0, 0.0)], 0.3) == [2]


def test_a_touch_that_was_missed_for_two_frames_goes_on():
    tracker = TouchTracker()
    for k in range(5):
        tracker.process([touch(0.0, 0.0)], 0.03 * k)
    tracker.process([], 0.15)
    tracker.process([], 0.18)
    assert tracker.process([touch(0.0, 0.0)], 0.21) == [1]


@pytest.mark.parametrize('rate', [15.0, 30.0, 60.0])
def test_touches_keep_their_numbers_at_any_rate(rate):
    tracker, rng = TouchTracker(), np.random.default_rng(0)
    for k in range(int(2 * rate)):
        x = 0.02 * (1 - np.cos(2 * k / rate))  # m, there and back at up to 0.04 m/s
        places = np.array([[x, 0.0], [0.02, 0.02 - x / 2]]) + SIGMA * rng.standard_normal((2, 2))
        assert tracker.process([touch(*place) for place in places], 1 + k / rate) == [1, 2]


def test_what_is_no_number_or_no_later_stamp_is_refused():
    tracker = TouchTracker()
    tracker.process([touch(0.0, 0.0)], 1.0)
    for stamp in (1.0, 0.5, np.nan):
        with pytest.raises(BadFrame, match='not later'):
            tracker.process([], stamp)
    with pytest.raises(BadArgument, match='finite place'):
        tracker.process([touch(np.nan, 0.0)], 2.0)
