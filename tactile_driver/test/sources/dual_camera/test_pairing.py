# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Frames of two cameras: never paired wrongly, whatever is lost, late, early or out of order."""
import numpy as np
import pytest

from tactile_driver.frame import Frame
from tactile_driver.camera.pairs import LEFT, RIGHT, Pairer

MS = 1_000_000


def frame(stamp, number=0):
    """A frame that carries its number."""
    return Frame(np.full((1, 1), number % 256, np.uint8), int(stamp), 'mono8')


def fed(pairer, events):
    """Pairs, as (left number, right number), from events (arrival, side, stamp, number) in the order of arrival."""
    pairs = []
    for _, side, stamp, number in sorted(events):
        pairer.add(side, frame(stamp, number))
        while (pair := pairer.take()) is not None:
            pairs.append((int(pair.left.image[0, 0]), int(pair.right.image[0, 0])))
    return pairs


def cameras(period, delay, count=60, jitter=0.0, lost=0.0, seed=0):
    """Events of two cameras, the right one delay ns later, with jitter of the stamps, lost frames and uneven transport in order."""
    rng = np.random.default_rng(seed)
    events = []
    for side in (LEFT, RIGHT):
        kept = np.flatnonzero(rng.uniform(size=count) >= lost)
        stamps = kept * period + side * delay + rng.normal(0, jitter, len(kept))
        arrivals = np.sort(stamps + rng.uniform(0, 3 * period, len(kept)))
        events += zip(arrivals.tolist(), [side] * len(kept), stamps.tolist(), kept.tolist())
    return events


@pytest.mark.parametrize('lost', [0.0, 0.2, 0.5])
@pytest.mark.parametrize('period', [10 * MS, 16.7 * MS, 33 * MS])
@pytest.mark.parametrize('seed', range(4))
def test_only_frames_of_one_instant_are_paired(period, lost, seed):
    events = cameras(period, 4 * MS, jitter=0.2 * MS, lost=lost, seed=seed)
    pairer = Pairer(8 * MS)
    pairs = fed(pairer, events)
    assert all(left == right for left, right in pairs)
    both = {k for _, s, _, k in events if s == LEFT} & {k for _, s, _, k in events if s == RIGHT}
    assert len(pairs) >= 0.95 * len(both) - 1
    waiting = pairer.waiting(LEFT) + pairer.waiting(RIGHT)
    assert pairer.unpaired == len(events) - 2 * len(pairs) - waiting


def test_the_first_pair_waits_until_the_period_is_known():
    pairer = Pairer(8 * MS)
    pairer.add(LEFT, frame(10 * MS))
    for k in range(5):
        assert pairer.take() is None, 'the right frame may belong to a left one that was lost'
        pairer.add(RIGHT, frame((4 + 10 * k) * MS))
    pair = pairer.take()
    assert (pair.left.stamp_ns, pair.right.stamp_ns, pairer.unpaired) == (10 * MS, 14 * MS, 1)


def test_a_stated_period_is_used_at_once():
    pairer = Pairer(8 * MS, 10 * MS)
    pairer.add(RIGHT, frame(4 * MS))
    pairer.add(LEFT, frame(10 * MS))
    assert pairer.take() is None and pairer.unpaired == 1
    pairer.add(RIGHT, frame(14 * MS))
    assert pairer.take().right.stamp_ns == 14 * MS


def test_the_last_pair_of_a_recording_needs_no_period():
    pairer = Pairer(8 * MS)
    pairer.add(LEFT, frame(0))
    pairer.add(RIGHT, frame(5 * MS))
    assert pairer.take() is None and pairer.take(last=True).right.stamp_ns == 5 * MS


def test_a_skew_over_the_limit_is_no_pair():
    pairer = Pairer(8 * MS)
    assert fed(pairer, cameras(100 * MS, 9 * MS)) == [] and pairer.unpaired >= 100
    assert len(fed(Pairer(8 * MS), cameras(100 * MS, 7 * MS))) == 60


def test_frames_out_of_order_are_dropped_and_a_jump_back_begins_anew():
    pairer = Pairer(8 * MS)
    for stamp in (100, 50, 100):
        pairer.add(LEFT, frame(stamp * MS))
    assert pairer.waiting(LEFT) == 1 and pairer.unpaired == 2
    later = [(k, side, (5000 + 20 * k) * MS, k) for k in range(5) for side in (LEFT, RIGHT)]
    again = [(10 + k, side, 20 * k * MS, k) for k in range(5) for side in (LEFT, RIGHT)]
    assert fed(Pairer(8 * MS), later + again) == [(k, k) for k in range(5)] * 2


def test_one_camera_alone_is_handed_over_and_does_not_pile_up():
    pairer = Pairer(8 * MS)
    for k in range(20):
        pairer.add(RIGHT, frame(20 * MS * k, k))
    assert pairer.waiting(RIGHT) == 8 and pairer.unpaired == 12
    single = pairer.take_single(RIGHT)
    assert single.left is None and single.stamp_ns == 240 * MS and single.sizes == {'right': (1, 1)}
    assert pairer.take_single(LEFT) is None
    pairer.forget()
    assert pairer.waiting(RIGHT) == 0 and pairer.unpaired == 12


@pytest.mark.parametrize('offset', [0.0, 0.2, 0.345, 0.49, 0.51, 0.8])
def test_at_any_offset_every_frame_pairs_with_the_nearest(offset):
    period = 33.3 * MS
    pairer = Pairer(-1)
    fed(pairer, cameras(period, offset * period, jitter=0.01 * period, seed=3))
    events = cameras(period, offset * period, count=200, jitter=0.01 * period, seed=4)
    stamps = [dict((number, stamp) for _, s, stamp, number in events if s == side) for side in (LEFT, RIGHT)]
    pairer = Pairer(-1)
    pairs = fed(pairer, [(max(arrival, stamp), side, stamp, number) for arrival, side, stamp, number in events])
    assert len(pairs) >= 194, 'jitter near half a period makes no frame unpaired'
    skews = np.array([stamps[RIGHT][right] - stamps[LEFT][left] for left, right in pairs])
    assert np.abs(skews).max() <= 0.56 * period and len(set(np.sign(skews))) == 1 or offset == 0.0


@pytest.mark.parametrize('ppm', [2000.0, -2000.0])
def test_a_drift_through_half_a_period_costs_one_frame(ppm):
    period, count = 33 * MS, 1000
    events = [(k * period * (1 + 1e-6 * ppm * side), side, k * period * (1 + 1e-6 * ppm * side), k)
              for side in (LEFT, RIGHT) for k in range(count)]
    pairer = Pairer(-1)
    pairs = fed(pairer, events)
    beats = abs(1e-6 * ppm) * count
    assert pairer.unpaired <= 1 + beats and len(pairs) >= count - 3 - beats
    assert pairer.shutters.numbers()['shutter drift (ppm)'] == pytest.approx(ppm, rel=0.01)


def test_an_offset_beyond_the_limit_is_measured_and_told():
    pairer = Pairer(8 * MS)
    assert fed(pairer, cameras(33 * MS, 11.5 * MS, jitter=0.2 * MS)) == []
    assert pairer.shutters.numbers()['shutter offset (ms)'] == pytest.approx(11.5, abs=0.2)
    assert '11.' in pairer.shutters.remark and 'max_skew is 8.0 ms' in pairer.shutters.remark
