# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Frames that come at a rate, taken by somebody who is slower: how old they get, and which are left out."""
import numpy as np
import pytest

from tactile_driver.sources import capture as frame_queue
from tactile_driver.sources.capture import FrameQueue


@pytest.fixture
def clock(monkeypatch):
    """A clock that is set by hand, s."""
    now = [100.0]
    monkeypatch.setattr(frame_queue.time, 'monotonic', lambda: now[0])
    return now


def taken_of(clock, keep, rate, work_s, count=600):
    """(queue, [(number, s waited)]) of count frames at rate Hz, where each one that is taken takes work_s."""
    queue, taken, begin, number = FrameQueue(keep), [], clock[0], 0
    while number < count:
        while number < count and begin + number / rate <= clock[0]:
            queue.add(number)
            number += 1
        frame = queue.take()
        if frame is None:
            clock[0] = begin + number / rate
            continue
        taken.append((frame, clock[0] - begin - frame / rate))
        clock[0] += work_s
    return queue, taken


@pytest.mark.parametrize(('keep', 'rate', 'work_s'), [(1, 60, 0.025), (100, 200, 0.008), (100, 1000, 0.0025), (1, 60, 0.05)])
def test_too_slow_it_leaves_out_evenly_and_nothing_gets_old(clock, keep, rate, work_s):
    count = 8 * rate
    queue, taken = taken_of(clock, keep, rate, work_s, count)
    lasting = [(number, waited) for number, waited in taken if number > 2 * rate]
    steps = np.diff([number for number, _ in lasting])
    assert max(waited for _, waited in lasting) < 0.06 + work_s
    assert steps.mean() == pytest.approx(rate * work_s, rel=0.1) and steps.max() <= np.ceil(rate * work_s) + 1
    assert 0 <= count - len(taken) - queue.left_out <= 0.06 * rate, 'but for those that still wait'
    assert queue.share_left_out == pytest.approx(1 - 1 / (rate * work_s), abs=0.05)


def test_fast_enough_it_leaves_nothing_out(clock):
    queue, taken = taken_of(clock, 1, 60, 0.015)
    assert [number for number, _ in taken] == list(range(600)) and (queue.left_out, queue.share_left_out) == (0, 0.0)


@pytest.mark.parametrize('step', [0.005, 0.1])
def test_a_hiccup_is_worked_off(clock, step):
    queue = FrameQueue(100)
    for _ in range(3):
        for number in range(8):
            queue.add(number)
            clock[0] += step
        assert [queue.take() for _ in range(9)] == [*range(8), None] and queue.left_out == 0
        clock[0] += 2.0


def test_it_says_how_long_a_frame_has_waited(clock):
    queue = FrameQueue(3)
    queue.add(1)
    clock[0] += 0.25
    queue.add(2)
    clock[0] += 0.5
    assert [(queue.take(), queue.waited_s) for _ in range(2)] == [(1, 0.75), (2, 0.5)]


def test_what_is_forgotten_does_not_count(clock):
    queue = FrameQueue(3)
    queue.add(1)
    queue.clear()
    assert len(queue) == 0 and queue.take() is None and queue.left_out == 0
