# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Stamps of one clock, what a node counts of its work, and which messages it drops when it is late."""
import math

import numpy as np
import pytest

from tactile_driver.nodes.runtime.diagnostics import ERROR, OK, WARN
from tactile_perception.core.clock import StampClock
from tactile_perception.core.errors import BadFrame, ClockSetBack
from tactile_perception.core.work_log import Shedding, WorkLog


def test_counts_times_and_latencies_of_processed_frames():
    log = WorkLog('image_raw')
    for seconds in (0.002, 0.004, 0.003):
        log.add(seconds, 2 * seconds)
    values = log.health(idle=False).values
    assert (values['frames'], values['refused frames']) == (3, 0)
    assert values['time per frame (ms)'] == pytest.approx(3.0)
    assert values['latency (ms)'] == pytest.approx(6.0)
    assert log.health(idle=False).level == OK


def test_the_latency_of_stamps_of_another_clock_is_not_known():
    log = WorkLog('image_raw')
    log.add(0.001, 1.8e9)
    values = log.health(idle=False).values
    assert math.isnan(values['latency (ms)']) and 'another clock' in values['stamps']
    log.add(0.001, 0.004)
    values = log.health(idle=False).values
    assert values['latency (ms)'] == pytest.approx(4.0) and values['stamps'] == 'of the clock of this node'


def test_a_refused_frame_is_an_error_until_a_good_one_comes():
    log = WorkLog('image_raw')
    log.add(0.001, 0.002)
    log.refuse('the frame is black')
    health = log.health(idle=False)
    assert (health.level, health.message, health.values['refused frames']) == (ERROR, 'the frame is black', 1)
    log.add(0.001, 0.002)
    assert log.health(idle=False).level == OK
    assert log.health(idle=False).values['last error'] == 'the frame is black'


def test_between_nodes_of_one_process_the_publisher_alone_tells_what_is_missing():
    log, period = WorkLog('dots', by_call=True), 33_333_333
    health = log.health(idle=False)
    assert health.level == OK and health.message == 'waiting for dots'
    for k in (*range(40), *range(80, 120)):
        log.arrive(10**18 + k * period)
        log.add(0.001, 0.002)
    assert log.health(False).level == OK and log.health(False).values['lost frames'] == 0


def test_lost_frames_are_counted_and_a_warning():
    log, period = WorkLog('image_raw'), 33_333_333
    log.add(0.001, 0.002)
    for k in range(40):
        log.arrive(10**18 + k * period)
    assert log.health(False).level == OK and log.health(False).values['lost frames'] == 0
    log.arrive(10**18 + 50 * period)
    health = log.health(False)
    assert health.values['lost frames'] == 10
    assert health.level == WARN and health.message.startswith('22 % of image_raw are missing according to the gaps in its stamps')
    log.restart_gaps()
    log.arrive(10**18 + 80 * period)
    assert log.health(False).values['lost frames'] == 10, 'nobody listened meanwhile'


def test_refused_frames_between_good_ones_are_a_warning_with_their_share():
    log = WorkLog('dots')
    for _ in range(10):
        log.refuse('dots: an index appears twice in id')
        log.add(0.001, 0.002)
    health = log.health(False)
    assert health.level == WARN and health.message == '50 % of dots is refused: dots: an index appears twice in id'


def test_silence_is_a_warning_that_names_the_topic_and_idleness_is_none():
    log = WorkLog('image_raw')
    silent = log.health(idle=False)
    assert silent.level == WARN and 'image_raw' in silent.message and math.isnan(silent.values['time per frame (ms)'])
    assert log.health(idle=True).level == OK


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


@pytest.fixture
def clock():
    clock = StampClock()
    assert not any(clock.restarts_at(100.0 + 0.1 * k) for k in range(50))
    return clock


def test_a_recording_that_loops_restarts_with_its_second_frame(clock):
    with pytest.raises(ClockSetBack, match=r'go back by 4\.9 s'):
        clock.restarts_at(100.0)
    assert [clock.restarts_at(t) for t in (100.1, 100.2, 100.3)] == [True, False, False]


def test_one_stamp_from_the_past_has_no_effect(clock):
    with pytest.raises(ClockSetBack):
        clock.restarts_at(3.0)
    assert not clock.restarts_at(105.0)
    with pytest.raises(ClockSetBack):
        clock.restarts_at(4.0)


def test_one_stamp_from_the_future_has_no_effect(clock):
    for stamp in (1e6, 2e9, 3e5):
        with pytest.raises(ClockSetBack, match='ahead'):
            clock.restarts_at(stamp)
    assert not clock.restarts_at(105.0)
    with pytest.raises(ClockSetBack, match='ahead'):
        clock.restarts_at(1e6)


def test_after_a_pause_of_an_hour_the_second_frame_is_accepted(clock):
    with pytest.raises(ClockSetBack, match='ahead'):
        clock.restarts_at(4000.0)
    assert [clock.restarts_at(t) for t in (4000.1, 4000.2)] == [False, False]


def test_a_frame_that_is_refused_leaves_no_stamp(clock):
    for error in (BadFrame, IndexError):
        with pytest.raises(error), clock.at(2000.0) as restarted:
            assert not restarted
            raise error('the picture is black')
    with clock.at(105.0) as restarted:
        assert not restarted
    with pytest.raises(ClockSetBack), clock.at(50.0):
        pass
    for _ in range(2):
        with pytest.raises(BadFrame), clock.at(50.1) as restarted:
            assert restarted
            raise BadFrame('the picture is black')
    with clock.at(50.1) as restarted:
        assert restarted


@pytest.mark.parametrize('stamp', [104.9, math.nan, math.inf])
def test_repeated_and_invalid_stamps_are_left_to_the_stage(clock, stamp):
    assert not clock.restarts_at(stamp)
    assert not clock.restarts_at(105.0)


def test_frames_out_of_order_have_no_effect(clock):
    for stamp in (104.7, 104.8):
        with pytest.raises(ClockSetBack, match='go back by 0'):
            clock.restarts_at(stamp)
    assert not clock.restarts_at(105.0)
    with pytest.raises(ClockSetBack):
        clock.restarts_at(104.9)


def test_a_step_back_of_less_than_a_second_restarts_with_the_third_frame(clock):
    for stamp in (104.2, 104.3):
        with pytest.raises(ClockSetBack):
            clock.restarts_at(stamp)
    assert clock.restarts_at(104.4)
    assert not clock.restarts_at(104.5)


def test_refused_frames_are_known_until_one_is_used():
    log = WorkLog('image_raw')
    assert not log.refuses
    log.refuse('no usable camera_info yet')
    assert log.refuses and log.last_error == 'no usable camera_info yet'
    log.add(1e-3, 2e-3)
    assert not log.refuses
