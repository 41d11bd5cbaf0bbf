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
        found = tracker.process([right, left] if k % 2 else [left, right], 0.03 * k)
        numbers = {t.id: np.sign(t.estimate.position[0]) for t in found}
        assert numbers == {1: -1.0, 2: 1.0}


def test_a_touch_that_ended_gives_its_number_to_no_other_one():
    tracker = TouchTracker()
    assert [t.id for t in tracker.process([touch(0.0, 0.0)], 0.0)] == [1]
    for k in range(1, 6):
        assert tracker.process([], 0.03 * k) == []
    assert [t.id for t in tracker.process([touch(0.0, 0.0)], 0.3)] == [2]


def test_a_touch_that_was_missed_for_two_frames_goes_on():
    tracker = TouchTracker()
    for k in range(5):
        tracker.process([touch(0.0, 0.0)], 0.03 * k)
    tracker.process([], 0.15)
    tracker.process([], 0.18)
    assert [t.id for t in tracker.process([touch(0.0, 0.0)], 0.21)] == [1]


def test_the_filter_does_not_delay_a_finger_that_moves_evenly_and_adds_no_noise():
    random = np.random.default_rng(0)
    for speed in (0.0, 0.05):
        tracker, raw, filtered = TouchTracker(), [], []
        for k in range(300):
            true = speed * k / 60 * np.array([1.0, 0.0])
            noisy = true + SIGMA * random.standard_normal(2)
            found = tracker.process([touch(*noisy)], k / 60)[0].estimate
            raw.append(noisy - true)
            filtered.append(found.position[:2] - true)
        assert np.std(filtered[50:]) < 0.98 * np.std(raw[50:])
        assert np.abs(np.mean(filtered[50:], axis=0)).max() < 0.2 * SIGMA


def test_a_drag_that_stops_at_once_is_not_overshot():
    tracker, sure = TouchTracker(), 3e-4
    for k in range(30):
        place = 0.1 * min(k, 20) / 30
        found = tracker.process([touch(place, 0.0, sigma=sure)], k / 30)[0].estimate
        assert k < 2 or abs(found.position[0] - place) < 2e-4


def test_a_step_is_followed_to_nine_tenths_in_thirty_milliseconds():
    tracker = TouchTracker()
    for k in range(600):
        tracker.process([touch(0.0, 0.0)], k / 200)
    for k in range(6):
        found = tracker.process([touch(3e-4, 0.0)], 3 + k / 200)
    assert found[0].id == 1
    assert found[0].estimate.position[0] > 0.9 * 3e-4


def test_the_covariance_of_what_is_filtered_is_honest():
    random = np.random.default_rng(1)
    squares = []
    for _ in range(60):
        tracker = TouchTracker()
        speed, place = np.zeros(2), np.zeros(2)
        for k in range(30):
            speed, place = speed + 0.3 / 60 * random.standard_normal(2), place + speed / 60
            found = tracker.process([touch(*(place + SIGMA * random.standard_normal(2)))], k / 60)[0].estimate
        off = found.position[:2] - place
        squares.append(off @ np.linalg.solve(found.covariance[:2, :2], off) / 2)
    assert 0.6 < np.mean(squares) < 1.5


def test_without_the_filter_the_estimate_goes_through():
    tracker, estimate = TouchTracker(filtered=False), touch(0.001, 0.002)
    tracker.process([touch(0.0, 0.0)], 0.0)
    assert tracker.process([estimate], 0.03)[0].estimate is estimate


def test_what_is_no_number_or_no_later_stamp_is_refused():
    tracker = TouchTracker()
    tracker.process([touch(0.0, 0.0)], 1.0)
    for stamp in (1.0, 0.5, np.nan):
        with pytest.raises(BadFrame, match='not later'):
            tracker.process([], stamp)
    with pytest.raises(BadArgument, match='finite place'):
        tracker.process([touch(np.nan, 0.0)], 2.0)
