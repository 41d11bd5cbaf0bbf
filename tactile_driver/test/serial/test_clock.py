# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The device's clock, and blocks of samples."""

import numpy as np
import pytest
from tactile_driver.serial.clock import DeviceClock, SampleAssembler
from tactile_driver.serial.frames import CountFrame


def played(skew, delays, start_us=0, step_us=5000, host_ns=7_000_000_000):
    """(true host times, mapped host times), ns, of frames every step_us of a device's clock that runs fast by skew."""
    clock = DeviceClock()
    true, mapped = [], []
    for k, delay in enumerate(delays):
        true.append(host_ns + k * step_us * 1000 / (1 + skew))
        mapped.append(clock.to_host([(start_us + k * step_us) % 2**32], round(true[-1] + delay))[0])
    return np.array(true), np.array(mapped), clock


@pytest.mark.parametrize('skew', [0.0, 80e-6, -80e-6])
def test_jitter_is_taken_off_and_drift_is_followed(skew):
    rng = np.random.default_rng(1)
    true, mapped, clock = played(skew, 3e5 + rng.exponential(2e6, 12000))
    late = mapped - true
    assert np.abs(late[6000:] - 3e5).max() < 1e5 + 5e9 * abs(skew)  # ns; it looks back 5 s
    assert np.abs(np.diff(mapped) - 5e6).max() < 0.06 * 5e6
    assert clock.resets == 0


def test_the_counter_may_wrap():
    true, mapped, clock = played(0.0, np.full(3000, 1e5), start_us=2**32 - 2_000_000)
    assert np.abs(mapped - true - 1e5).max() < 1e3 and clock.resets == 0


def test_a_reset_and_a_pause_begin_anew_or_go_on():
    clock = DeviceClock()
    for k in range(100):
        clock.to_host([10_000_000 + 5000 * k], 10**10 + 5_000_000 * k)
    assert clock.to_host([0], 10**10 + 2 * 10**9) == [10**10 + 2 * 10**9] and clock.resets == 1
    assert clock.to_host([60_000_000], 10**10 + 62 * 10**9) == [10**10 + 62 * 10**9] and clock.resets == 1


def test_time_never_goes_back():
    _, mapped, _ = played(0.0, np.r_[np.full(200, 2e7), np.full(2000, 1e5)])
    assert np.diff(mapped).min() > 0


def test_frames_that_come_in_one_go_keep_their_distances():
    clock = DeviceClock()
    assert np.diff(clock.to_host([0, 1000, 2000, 3000], 5_000_000, 800_000)).tolist() == [1_000_000] * 3
    assert clock.to_host([4000], 9_000_000)[0] == 5_200_000  # the earlier arrival tells


def test_a_reset_amid_the_frames_of_one_go():
    clock = DeviceClock()
    clock.to_host([50_000_000], 10**9)
    before, after = clock.to_host([50_001_000, 0], 10**9 + 1_000_000)
    assert (before, after, clock.resets) == (10**9 + 1_000_000, 10**9 + 1_000_000, 1)


def frame(k, rows=5, period_us=200, interval=True, timed=True):
    values = np.tile(np.arange(k * rows, (k + 1) * rows, dtype=np.uint16)[:, None], (1, 4))
    return CountFrame(values, (k * rows * period_us) % 2**32 if timed else None, period_us * 1000 if interval else None, k, 12)


def test_frames_without_a_gap_are_one_block():
    blocks = SampleAssembler(5.0).assemble([frame(k) for k in range(10)], 10**9)
    assert len(blocks) == 1
    assert blocks[0].volts.shape == (50, 4) and blocks[0].volts.dtype == np.float32
    assert blocks[0].volts[:, 2] == pytest.approx(np.arange(50) * 5 / 4096)
    assert blocks[0].period_s == pytest.approx(200e-6)


def test_a_missing_frame_parts_two_blocks():
    assembler = SampleAssembler(5.0)
    first = assembler.assemble([frame(0), frame(1)], 2_000_000)
    blocks = assembler.assemble([frame(2), frame(4), frame(5)], 6_000_000)
    assert [len(b.volts) for b in first + blocks] == [10, 5, 10]
    assert blocks[1].stamp_ns - blocks[0].stamp_ns == pytest.approx(2_000_000, abs=1e5)
    assert assembler.missing == 5


def test_lines_with_time_but_without_an_interval():
    assembler = SampleAssembler(5.0)
    assembler.assemble([frame(0, 1, 1000, interval=False)], 0)
    block, = assembler.assemble([frame(k, 1, 1000, interval=False) for k in range(1, 6)], 5_000_000)
    assert len(block.volts) == 5 and block.period_s == pytest.approx(1e-3, rel=0.06)
    blocks = assembler.assemble([frame(k, 1, 1000, interval=False) for k in (6, 7, 10, 11)], 11_000_000)
    assert [len(b.volts) for b in blocks] == [2, 2] and assembler.missing == 2


def test_lines_without_time_lie_between_arrivals():
    assembler = SampleAssembler(5.0)
    first, = assembler.assemble([frame(0, 1, timed=False, interval=False)], 1_000_000)
    assert np.isnan(first.period_s) and first.stamp_ns == 1_000_000
    block, = assembler.assemble([frame(k, 1, timed=False, interval=False) for k in range(4)], 5_000_000)
    assert block.period_s == pytest.approx(1e-3) and block.stamp_ns == 2_000_000
