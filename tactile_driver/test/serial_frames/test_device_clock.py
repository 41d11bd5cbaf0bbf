# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.serial.clock import DeviceClock


def played(skew, delays, start_us=0, step_us=5000, host_ns=7_000_000_000):
    """(true host times, mapped host times), ns, of frames every step_us of a device's clock that runs fast by skew."""
    clock = DeviceClock()
    true, mapped = [], []
    for k, delay in enumerate(delays):
        true.append(host_ns + k * step_us * 1000 / (1 + skew))
        mapped.append(clock.to_host([(start_us + k * step_us) % 2**32], round(true[-1] + delay))[0])
    return np.array(true), np.array(mapped), clock


@pytest.mark.parametrize('skew', [0.0, 80e-6, -80e-6])
def test_jitter_is_taken_off_and_the_rate_is_followed(skew):
    rng = np.random.default_rng(1)
    true, mapped, clock = played(skew, 3e5 + rng.exponential(2e6, 12000))
    late = mapped - true
    assert np.abs(late[6000:] - 3e5).max() < 1e5  # ns
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
