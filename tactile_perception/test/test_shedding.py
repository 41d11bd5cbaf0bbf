# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated queue of the middleware with a slow consumer: age of the processed messages, and which are dropped."""
import numpy as np
import pytest
from tactile_perception.work_log import Shedding

MS = 1_000_000


def done_of(rate, work_ms, seconds=4.0, depth=10, stamped=lambda number: 0):
    """(number, wait in ms) of the processed messages; each takes work_ms, a dropped one no time."""
    shedding, sent = Shedding(), [round(k * 1e9 / rate) + 10**12 for k in range(int(seconds * rate))]
    now, done, queue, coming = sent[0], [], [], 0
    while coming < len(sent):
        while coming < len(sent) and sent[coming] <= now:
            queue = [*queue, coming][-depth:]
            coming += 1
        if not queue:
            now = sent[coming] if coming < len(sent) else now
            continue
        number = queue.pop(0)
        if not shedding.is_late(sent[number] + stamped(number), sent[number], now):
            done.append((number, (now - sent[number]) / MS))
            now += round(work_ms * MS)
    return done


@pytest.mark.parametrize(('rate', 'work_ms'), [(60, 25), (200, 7), (1000, 3), (10, 150)])
def test_a_slow_node_drops_evenly_and_waits_stay_short(rate, work_ms):
    done = done_of(rate, work_ms)[20:]
    steps = np.diff([number for number, _ in done])
    assert max(wait for _, wait in done) < max(50, 2000 / rate) + 1
    assert np.mean(steps) == pytest.approx(rate * work_ms / 1000, rel=0.1), 'all that it has time for is done'
    assert steps.max() <= np.ceil(rate * work_ms / 1000) + 1


def test_a_fast_node_drops_nothing():
    assert [number for number, _ in done_of(60, 16)] == list(range(len(done_of(60, 16))))


def test_a_short_pause_is_caught_up():
    shedding = Shedding()
    for k in range(100):
        assert not shedding.is_late(k * 16 * MS, k * 16 * MS + 1, k * 16 * MS + 2)
    assert not shedding.is_late(1600 * MS, 1600 * MS, 1645 * MS)
    assert shedding.is_late(1616 * MS, 1616 * MS, 1670 * MS)


def test_nothing_is_dropped_of_a_recording_played_fast():
    slow, fast = (done_of(200, 8, depth=100, stamped=lambda number: number * more) for more in (0, 20 * MS))
    assert max(wait for _, wait in slow) < 60 < 400 < max(wait for _, wait in fast)


def test_a_clock_set_back_has_no_effect():
    shedding = Shedding()
    for k in range(10):
        assert not shedding.is_late(k * 16 * MS, 10**12 + k * 16 * MS, 10**12 + k * 16 * MS + MS)
    assert not shedding.is_late(0, 10**6, 10**6 + MS) and not shedding.is_late(16 * MS, 10**12 + 200 * MS, 10**12 + 201 * MS)


def test_without_times_of_reception_nothing_is_dropped():
    assert not Shedding().is_late(10**18, 0, 10**18)
