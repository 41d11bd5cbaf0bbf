# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How many messages are missing, reported by the stamps of the others."""
import numpy as np
import pytest

from tactile_driver.stamp_gaps import StampGaps

MS = 1_000_000


def counted(stamps, covered_ns=0):
    gaps = StampGaps('image_raw')
    for stamp in stamps:
        gaps.add(int(stamp), covered_ns)
    return gaps


def stamps_of(rate, count, jitter=0.0, seed=1):
    rng = np.random.default_rng(seed)
    return ((np.arange(count) + jitter * rng.uniform(-1, 1, count)) / rate * 1e9 + 10**18).astype(np.int64)


@pytest.mark.parametrize('rate', [5, 30, 200, 1000])
@pytest.mark.parametrize('jitter', [0.0, 0.1])
def test_of_a_whole_stream_nothing_is_missing(rate, jitter):
    gaps = counted(stamps_of(rate, 500, jitter))
    assert gaps.lost == 0 and gaps.warning == ''


@pytest.mark.parametrize('every', [3, 10, 30])
def test_what_is_left_out_is_counted(every):
    number = np.arange(300)
    assert counted(stamps_of(30, 300)[(number < 10) | (number % every > 0)]).lost == np.count_nonzero(number[10:] % every == 0)


@pytest.mark.parametrize('through', [0.34, 0.8])
@pytest.mark.parametrize('jitter', [0.0, 0.05])
def test_where_most_are_lost_they_are_counted_all_the_same(through, jitter):
    arrived = np.random.default_rng(3).uniform(size=600) < through
    arrived[[0, -1]] = True
    gaps = counted(stamps_of(30, 600, jitter)[arrived])
    assert gaps.lost == pytest.approx(600 - arrived.sum(), rel=0.1)
    assert int(gaps.warning.split(' %')[0]) == pytest.approx(100 * (1 - through), abs=10) and 'of image_raw are missing' in gaps.warning


def test_what_is_lost_while_the_receiver_takes_up_its_work_is_counted_and_no_news():
    gaps = counted(np.delete(stamps_of(30, 60), np.arange(1, 26)))
    assert gaps.lost == 25 and gaps.warning == ''


def test_a_pause_or_stamps_that_go_back_are_no_loss():
    stamps = stamps_of(30, 60)
    paused = stamps + 2_100 * MS + 60 * 34 * MS
    assert counted([*stamps, *paused, *stamps]).lost == 0


def test_nothing_is_missing_from_a_time_when_nobody_listened():
    gaps, stamps = StampGaps('dots'), stamps_of(30, 60)
    for stamp in stamps[:20]:
        gaps.add(int(stamp))
    gaps.reset()
    for stamp in stamps[40:]:
        gaps.add(int(stamp))
    assert gaps.lost == 0


def test_a_camera_that_halves_its_rate_is_followed_within_two_seconds():
    gaps = counted([*stamps_of(30, 200), *(stamps_of(15, 400) + 200 * 34 * MS)])
    assert 0 < gaps.lost < 40 and gaps.warning == '', 'the newest 120 are all right'


def test_samples_in_blocks_of_any_length_are_no_gaps_but_a_missing_block_is():
    gaps, stamp = StampGaps('voltages'), 10**18
    for k in range(300):
        covered = (3 + 4 * (k % 2)) * MS
        if k not in (100, 200):
            gaps.add(stamp, covered)
        stamp += covered
    assert gaps.lost == 2
