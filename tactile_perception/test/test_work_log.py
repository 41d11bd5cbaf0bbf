# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The health of a node on /diagnostics."""
import math

import pytest
from tactile_driver.nodes.runtime.diagnostics import ERROR, OK, WARN
from tactile_perception.work_log import WorkLog


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
    assert health.level == WARN and health.message.startswith('22 % of image_raw are missing, by the gaps in its stamps')
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
