# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Offset, drift and jitter of two cameras, from their stamps."""
import numpy as np
import pytest

from tactile_driver.camera.pairs import ShutterOffset

MS, START = 1_000_000, 1_700_000_000 * 10**9
PERIOD = 33_333_333


def measured(offsets_ms, **limits):
    shutters = ShutterOffset(**limits)
    for k, offset in enumerate(offsets_ms):
        shutters.add(START + k * PERIOD, START + k * PERIOD + round(offset * MS), PERIOD)
    return shutters


@pytest.mark.parametrize('ppm', [0.0, 50.0, -400.0])
def test_what_the_stamps_say_is_told(ppm):
    jitter = np.random.default_rng(1).normal(0, 0.3, 300)
    offsets = 5.0 + 1e-6 * ppm * np.arange(300) * PERIOD / MS
    found = measured(offsets + jitter).numbers()
    assert found['shutter offset (ms)'] == pytest.approx(offsets[-1], abs=0.1)
    assert found['shutter drift (ppm)'] == pytest.approx(ppm, abs=60.0) and found['shutter jitter (ms)'] == pytest.approx(0.3, rel=0.15)


def test_a_drift_that_changes_is_no_jitter():
    found = measured(9 * np.sin(2 * np.pi * np.arange(300) / 750)).numbers()
    assert found['shutter jitter (ms)'] < 0.01 and found['shutter offset (ms)'] == pytest.approx(9 * np.sin(2 * np.pi * 299 / 750), abs=1.2)


def test_too_few_pairs_tell_nothing():
    assert np.isnan(list(measured([5.0] * 9).numbers().values())).all()


def test_frames_that_pair_in_another_way_are_measured_anew():
    found = measured([16.0] * 50 + [-17.0] * 10).numbers()
    assert found == pytest.approx({'shutter offset (ms)': -17.0, 'shutter drift (ppm)': 0.0, 'shutter jitter (ms)': 0.0}, abs=1e-6)


def test_an_offset_beyond_the_limit_is_remarked():
    assert measured([7.0] * 20, limit_ns=8 * MS).remark == '' == measured([12.0] * 20).remark
    remark = measured([-11.5] * 20, limit_ns=8 * MS).remark
    assert '11.5 ms apart' in remark and 'max_skew is 8.0 ms' in remark and 'set max_skew to -1' in remark
